"""List which symbols of the package mention which: the way from a kernel to host code that tests run."""

import ast
import re
from collections import defaultdict
from functools import cache

from tests.mutants.header_faults import functions_of
from tests.mutants.mutant import PACKAGE, ROOT
from tests.mutants.source import symbols_of


@cache
def users():
    """For each `file::symbol` of the package, also of headers, those whose code mentions it."""
    modules = {path.relative_to(ROOT / PACKAGE).as_posix(): path for path in (ROOT / PACKAGE).rglob("*.py")}
    trees = {file: ast.parse(path.read_text("utf-8")) for file, path in modules.items()}
    used = defaultdict(set)
    for file, tree in trees.items():
        names, imported = _names(file, tree, trees)
        for symbol, node in symbols_of(tree):
            for mentioned in [*_mentioned(node, names, imported), *_native(file, node)]:
                if mentioned != f"{file}::{symbol}":
                    used[mentioned].add(f"{file}::{symbol}")
            if "." in symbol:  # who uses a class may use its methods
                used[f"{file}::{symbol}"].add(f"{file}::{symbol.split('.')[0]}")
    _add_headers(used)
    return used


def _native(file, node):
    """Yield the functions of the header beside a module that a node takes the C++ of."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Call) and getattr(inner.func, "id", "") == "native":
            yield f"{file.removesuffix('py')}h::{inner.args[1].value}"


def _add_headers(used):
    """Add the functions of headers that call another, whichever header that is in."""
    package = ROOT / PACKAGE
    texts = {path.relative_to(package).as_posix(): path.read_text("utf-8") for path in package.rglob("*.h")}
    functions = [(file, text, *f) for file, text in texts.items() for f in functions_of(text)]
    for file, text, user, start, end in functions:
        called = set(re.findall(r"\b(\w+)(?=\()", text[start:end]))
        for other, _, name, *_ in functions:
            if name in called and (other, name) != (file, user):
                used[f"{other}::{name}"].add(f"{file}::{user}")


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
