"""Faults are to hit the program at its work, not the compiler of its kernels."""

import signal
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


@pytest.fixture(scope="package", autouse=True)
def heeded_interrupts():
    """A shell starts what it runs in the background deaf to SIGINT, and children inherit that."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
