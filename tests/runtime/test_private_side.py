"""Undocumented parts of Warp are used in `dmc_cli/runtime` alone, and kernels are launched there alone."""

import ast
import re
from pathlib import Path

import pytest

import dmc_cli

PACKAGE = Path(dmc_cli.__file__).parent

PRIVATE = {
    "launch": "Device.launch",
    "launch_tiled": "Device.launch",
    "_src": "nothing",
    "context": "nothing",
    "codegen": "nothing",
    "get_module": "load_kernels",
    "get_module_identifier": "kernel_cache",
    "kernel_cache_dir": "kernel_cache.cache_folder",
    "force_load": "load_kernels",
    "load_module": "load_kernels",
    "type_size_in_bytes": "arrays.size_of",
    "__ctype__": "CompiledKernel.pack",
    "_source": "arrays.view or arrays.adopt",
    "record_cmd": "CompiledKernel",
    "native_snippet": "nothing",
}
"""Names of Warp's, and what of `runtime` stands for them elsewhere."""

OF_WARP_ALONE = {"launch", "launch_tiled", "context", "codegen", "get_module", "force_load", "load_module"}
"""Names that mean something else where they are not taken from Warp itself."""


def private_uses(source: str) -> set[str]:
    """The private names that a module takes of Warp and its objects."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute) and node.attr in PRIVATE:
            is_warp = isinstance(node.value, ast.Name) and node.value.id in {"wp", "warp"}
            if is_warp or node.attr not in OF_WARP_ALONE:
                found.add(node.attr)
        elif isinstance(node, ast.keyword) and node.arg == "record_cmd":
            found.add("record_cmd")
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in {"wp.array", "warp.array"}:
            found |= {"ptr"} & {keyword.arg for keyword in node.keywords}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "warp":
            found.add(f"from {node.module}")
        elif isinstance(node, ast.Import):
            found |= {f"import {name.name}" for name in node.names if name.name.startswith("warp.")}
    return found


LAUNCHES = {f"{warp}.{name}" for warp in ("wp", "warp") for name in ("launch", "launch_tiled")}
"""What launches a kernel by Warp."""

LAYOUT = re.compile(r"\*\)\s*\(*&|\breinterpret_cast\b|\.data\b|\.strides\b|\.c\b")
"""What a header does that takes for granted how Warp's arrays and vectors lie in memory."""

SOURCES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.parent.name != "runtime"]


def test_the_rest_of_the_package_uses_what_warp_documents():
    uses = {str(path.relative_to(PACKAGE)): private_uses(path.read_text("utf-8")) for path in SOURCES}
    assert len(uses) > 150
    assert {name: found for name, found in uses.items() if found} == {}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("wp.launch(k, 1, [])", {"launch"}),
        ("device.launch(k, 1, [], [])", set()),
        ("wp.array(ptr=1, dtype=wp.int32)", {"ptr"}),
        ("view._source = a", {"_source"}),
        ("import warp._src.types", {"import warp._src.types"}),
        ("from warp import types", {"from warp"}),
        ("import warp as wp", set()),
        ("a.__ctype__()", {"__ctype__"}),
        ("wp.config.kernel_cache_dir", {"kernel_cache_dir"}),
    ],
)
def test_a_private_use_is_found(source, expected):
    assert private_uses(source) == expected


def test_headers_leave_the_layout_of_arrays_and_vectors_to_runtime():
    headers = sorted(PACKAGE.rglob("*.h"))
    found = {path.relative_to(PACKAGE) for path in headers if LAYOUT.search(path.read_text("utf-8"))}
    assert len(headers) > 15
    assert {str(path) for path in found if path.parent.name != "runtime"} == set()
    assert "pointers.h" in {path.name for path in found}


@pytest.mark.parametrize(
    ("line", "is_private"),
    [
        ("(double*)&lanes + 16", True),
        ("(float*)(&lanes)", True),
        ("(const int *) &lanes", True),
        ("reinterpret_cast<float*>(values)", True),
        ("(char*)values.data", True),
        ("values.strides[0]", True),
        ("lanes.c[3]", True),
        ("*(const values_t*)RUN(nodes + done, 32)", False),
        ("COMPONENTS(double, lanes) + 16", False),
        ("load(&word, values.shape[0])", False),
    ],
)
def test_a_use_of_the_layout_is_found(line, is_private):
    assert bool(LAYOUT.search(line)) == is_private


def test_warp_launches_in_one_place():
    calls = {}
    for path in PACKAGE.rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text("utf-8")))
        uses = [node for node in nodes if isinstance(node, ast.Attribute) and ast.unparse(node) in LAUNCHES]
        if uses:
            calls[path.name] = len(uses)
    assert calls == {"warp_launch.py": 1}


def test_runtime_has_the_uses_that_are_looked_for():
    uses = set().union(
        *(private_uses(path.read_text("utf-8")) for path in (PACKAGE / "runtime").glob("*.py"))
    )
    assert {"launch", "ptr", "_source", "__ctype__", "record_cmd", "get_module_identifier"} <= uses
