"""The `__init__.py` of each folder says in which order to read its files, and names them all."""

import ast
import re

import pytest

from tests.docs.readme import ROOT

PACKAGE = ROOT / "dmc_cli"
FOLDERS = sorted(path.parent for path in PACKAGE.rglob("__init__.py") if path.parent != PACKAGE)


def listed(folder):
    """Return the names in the order of the list: `name  what it is`, or several names with commas."""
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8")))
    rows = re.findall(r"^(\w+/?(?:, \w+/?)*)  +\S", text, re.MULTILINE)
    return [name for row in rows for name in row.split(", ")]


def there(folder):
    """Return the names of a folder's files and folders; a header beside a file of its name goes with it."""
    files = {path.stem for path in folder.iterdir() if path.suffix in (".py", ".h")}
    return files - {"__init__"} | {f"{path.parent.name}/" for path in folder.glob("*/__init__.py")}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_the_reading_order_names_every_file_once(folder):
    names = listed(folder)
    assert sorted(names) == sorted(there(folder))
