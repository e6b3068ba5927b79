"""Sixteen isovalues of a scan, in one run of `dmc convert` and in sixteen, as whole processes.

The scan is written down first as an array that every run maps, so that none reads or unpacks anything.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from dmc_cli.volume import Volume

ISOVALUES = tuple(range(-500, 1100, 100))
"""Of the head CT, sixteen: from air to dense bone."""


def run(scan: str, folder: Path, isovalues: tuple[int, ...], threads: int) -> float:
    """Return the seconds of one run that writes a mesh for each isovalue."""
    chosen = [word for isovalue in isovalues for word in ("-i", str(isovalue))]
    output = str(folder / ("mesh_{isovalue}.ply" if len(isovalues) > 1 else f"mesh_{isovalues[0]}.ply"))
    words = [sys.executable, "-m", "dmc_cli", "convert", scan, output, *chosen, "--force", "--quiet"]
    words += ["--device", "cpu", "--threads", str(threads)]
    environment = os.environ | {"PYTHONPYCACHEPREFIX": str(folder / "pycache")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    start = time.perf_counter()
    subprocess.run(words, check=True, env=environment, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def one_and_sixteen_runs(volume: Volume, threads: int, rounds: int) -> tuple[float, float]:
    """Return the seconds of one run at all isovalues, and those of a run at each, the least of all rounds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scan = str(folder / "scan.npy")
        np.save(scan, volume.values)
        # values are what is stored, so isovalues are, too
        stored = tuple(round((isovalue - volume.intercept) / volume.slope) for isovalue in ISOVALUES)
        for isovalues in (stored[-2:], stored[-1:]):  # compiles what is not yet, and fills the caches
            run(scan, folder, isovalues, threads)
        together, each = [], [[] for _ in stored]
        for _ in range(rounds):
            together.append(run(scan, folder, stored, threads))
            for n, isovalue in enumerate(stored):
                each[n].append(run(scan, folder, (isovalue,), threads))
    return min(together), sum(min(seconds) for seconds in each)
