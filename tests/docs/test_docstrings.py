"""Docstrings of functions and of modules begin with a verb: D401 of ruff lets others pass."""

import ast

import pytest

from tests.docs.readme import ROOT

NO_VERBS = {
    *("A", "An", "The", "All", "Any", "Each", "Every", "No", "One", "Two", "Three", "Some"),
    *("How", "What", "When", "Where", "Whether", "Which", "Who", "Why", "If", "It", "This", "True"),
}
"""Words that a noun, a question or a condition begins with."""

FILES = sorted((ROOT / "dmc_cli").rglob("*.py"))


def docstrings(path):
    """Yield the docstrings of the functions of a file."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef) and ast.get_docstring(node):
            yield ast.get_docstring(node)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_docstring_begins_with_a_verb(path):
    assert [text for text in docstrings(path) if text.split()[0] in NO_VERBS] == []


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_docstring_of_a_module_begins_with_a_verb(path):
    text = ast.get_docstring(ast.parse(path.read_text("utf-8")))
    assert text is not None
    first = text.split()[0]
    assert first not in NO_VERBS
    assert first.isalpha() and not first.isupper()  # no name of a format
