"""The same mesh from kernels compiled for a processor without wide vectors, the oldest, and as on a GPU."""

import hashlib
import os
import subprocess
import sys

import pytest

CONVERT = """
import sys, warp as wp
wp.config.cpu_compiler_flags = sys.argv.pop(1)
from dmc_cli.cli import main
main()
"""

JOBS = {"noise": ("synth:noise:48", "0.5"), "smooth": ("synth:iwp:64", "0")}


def meshes_of(flags: str, folder) -> dict[str, str]:
    """Hashes of the meshes and halfedges that kernels compiled with these flags make."""
    folder.mkdir()
    env = os.environ | {"WARP_CACHE_PATH": str(folder / "kernels")}
    hashes = {}
    for name, (volume, isovalue) in JOBS.items():
        mesh, dump = folder / f"{name}.ply", folder / f"{name}.npz"
        options = ["convert", volume, str(mesh), "-i", isovalue, "--simplify", "all"]
        options += ["--halfedges", str(dump), "--threads", "2"]
        subprocess.run([sys.executable, "-c", CONVERT, flags, *options], env=env, check=True)
        for path in (mesh, dump):
            hashes[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return hashes


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("flags", ["-target-cpu x86-64-v3", "", "-march=native -DDMC_AS_ON_GPU"])
def test_the_processors_instructions_do_not_show_in_the_mesh(flags, tmp_path):
    if os.uname().machine != "x86_64":
        pytest.skip("these are instruction sets of x86-64")
    assert meshes_of(flags, tmp_path / "other") == meshes_of("-march=native", tmp_path / "own")
