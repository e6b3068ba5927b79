"""Faults are to hit the program at its work, not the compiler of its kernels."""

import subprocess
import sys

import pytest


@pytest.fixture(scope="package", autouse=True)
def compiled_kernels(tmp_path_factory):
    """Fill the kernel cache once, as the first convert on a machine does."""
    folder = tmp_path_factory.mktemp("warm")
    words = ["-i", "0", "--simplify", "all", "--halfedges", "dump.npz", "--report", "report.json"]
    command = [sys.executable, "-m", "dmc_cli", "convert", "synth:iwp:16", "mesh.ply", *words]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=280)
