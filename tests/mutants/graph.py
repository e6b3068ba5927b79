"""Which symbols of the package mention which: the way from a kernel to host code that tests run."""

import ast
from collections import defaultdict

from tests.mutants.mutant import PACKAGE, ROOT
from tests.mutants.source import symbols_of


def users():
    """For each `file::symbol` of the package those whose code mentions it."""
    modules = {path.relative_to(ROOT / PACKAGE).as_posix(): path for path in (ROOT / PACKAGE).rglob("*.py")}
    trees = {file: ast.parse(path.read_text("utf-8")) for file, path in modules.items()}
    used = defaultdict(set)
    for file, tree in trees.items():
        names, imported = _names(file, tree, trees)
        for symbol, node in symbols_of(tree):
            for mentioned in _mentioned(node, names, imported):
                if mentioned != f"{file}::{symbol}":
                    used[mentioned].add(f"{file}::{symbol}")
            if "." in symbol:  # who uses a class may use its methods
                used[f"{file}::{symbol}"].add(f"{file}::{symbol.split('.')[0]}")
    return used


def _names(file, tree, trees):
    """Return what the names of a module stand for: symbols, and modules of the package."""
    names = {symbol: f"{file}::{symbol}" for symbol, _ in symbols_of(tree) if "." not in symbol}
    imported = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == PACKAGE:
            folder = "/".join(node.module.split(".")[1:])
            home = f"{folder}.py" if f"{folder}.py" in trees else f"{folder}/__init__.py".lstrip("/")
            for alias in node.names:
                inner = f"{folder}/{alias.name}.py".lstrip("/")
                if inner in trees:
                    imported[alias.asname or alias.name] = inner
                else:
                    names[alias.asname or alias.name] = f"{home}::{alias.name}"
    return names, imported


def _mentioned(node, names, imported):
    for inner in ast.walk(node):
        if isinstance(inner, ast.Name) and inner.id in names:
            yield names[inner.id]
        elif isinstance(inner, ast.Attribute) and getattr(inner.value, "id", None) in imported:
            yield f"{imported[inner.value.id]}::{inner.attr}"
