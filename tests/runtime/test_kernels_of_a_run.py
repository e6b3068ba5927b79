"""A run loads, and so compiles, the kernels of its own method and of no other one."""

import os
import subprocess
import sys

import pytest

from dmc_cli.methods import METHODS

FOLDERS = {
    "dmc": "dual_marching_cubes",
    "mc": "marching_cubes",
    "tmc": "topological_marching_cubes",
    "nets": "surface_nets",
    "dc": "dual_contouring",
    "macet": "macet",
}

PROBE = """
import sys
import warp as wp
from dmc_cli.cli import dmc
try:
    dmc(sys.argv[1:], prog_name="dmc")
except SystemExit as stop:
    assert not stop.code, stop.code
with_kernels = [module for module in wp._src.context.user_modules.values() if module.execs]
print(*sorted(module.name for module in with_kernels))
print(*sorted(name for name in sys.modules if name.startswith("dmc_cli.contouring.")))
"""


def modules_of(tmp_path, *words):
    """Return the modules whose kernels a conversion loads, and all of contouring that it imports."""
    output = str(tmp_path / "mesh.ply")
    result = subprocess.run(
        [sys.executable, "-c", PROBE, "convert", "synth:torus:12", output, "-i", "0", "--quiet", *words],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=300,
    )
    assert result.returncode == 0, result.stderr
    return tuple(set(line.split()) for line in result.stdout.splitlines()[-2:])


def test_every_method_has_its_folder():
    assert set(FOLDERS) == set(METHODS)


SHARED_BY_OTHERS = {
    "active_cells",
    "cell_quads",
    "cell_triangles",
    "edge_ranks",
    "edge_vertices",
    "indexed_classification",
    "special_list",
}
"""Modules with kernels that the first method has no use for, wherever they are."""


def assert_own(method, loaded, imported):
    own = f"dmc_cli.contouring.{FOLDERS[method]}."
    assert any(name.startswith("dmc_cli.contouring.") for name in loaded)
    assert any(name.startswith(own) for name in imported)
    others = {f"dmc_cli.contouring.{folder}." for folder in FOLDERS.values()} - {own}
    found = {name for name in loaded | imported if any(name.startswith(other) for other in others)}
    assert {name for name in found if not name.endswith(".declaration")} == set()


def test_a_plain_run_takes_no_kernel_of_another_method(tmp_path):
    loaded, imported = modules_of(tmp_path)
    assert_own("dmc", loaded, imported)
    assert {name.rpartition(".")[2] for name in loaded}.isdisjoint(SHARED_BY_OTHERS)


@pytest.mark.slow
@pytest.mark.parametrize("method", [name for name in METHODS if name != "dmc"])
def test_a_run_takes_no_kernel_of_another_method(tmp_path, method):
    assert_own(method, *modules_of(tmp_path, "--method", method))
