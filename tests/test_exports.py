"""Names that a folder offers to others are there, and none is that of a file."""

import ast
from importlib import import_module

import pytest

from tests.docs.readme import ROOT

STUBS = sorted((ROOT / "dmc_cli").rglob("__init__.pyi"))


@pytest.mark.parametrize("stub", STUBS, ids=lambda path: path.parent.name)
def test_every_name_can_be_imported_and_hides_no_file(stub):
    folder = import_module(".".join(stub.parent.relative_to(ROOT).parts))
    tree = ast.parse(stub.read_text("utf-8"))
    names = [name.asname for node in tree.body for name in node.names]
    assert sorted(folder.__all__) == sorted(names)
    assert len(set(names)) == len(names)
    for name in names:
        assert getattr(folder, name) is not None
        # the machinery of imports would put the file in the place of the name
        assert not (stub.parent / f"{name}.py").exists()
        assert not (stub.parent / name).exists()
