"""Benchmarks measure what everybody can call: they import no further than a folder, as the program does."""

import ast

import pytest

from tests.conftest import ROOT

SCRIPTS = sorted((ROOT / "benchmarks").glob("*.py"))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_a_folder_is_entered_by_its_init(script):
    nodes = list(ast.walk(ast.parse(script.read_text("utf-8"))))
    names = [node.module for node in nodes if isinstance(node, ast.ImportFrom)]
    names += [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    assert not [name for name in names if name.startswith("dmc_cli.") and name.count(".") > 1]
