"""A whole `dmc convert` of a CT as .nii.gz to .ply beside its floor, processes and all, kernels cached.

    python benchmarks/convert.py [--rounds 7] [--out NAME]

The floor is what no program on Warp and nibabel goes below: the start of Python with both imported and Warp
initialised, and the decompression of the file, which may overlap with it. Rounds are interleaved; each figure
is the least of its rounds. The goal is the start plus 1.5 times the decompression by Python's own gzip.
What nibabel costs a convert is told apart: Warp started alone, and with what the command imports of nibabel
(`cli/light_nibabel.py`) for a NIfTI file on top: in the command, part of it hides beside Warp's import.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from cases import CASES
from history import record

from dmc_cli.volume import Volume
from dmc_cli.volume_io import write_volume

START = "import warp, nibabel; warp.config.quiet = True; warp.init()"
WARP = """
from dmc_cli.cli.light_nibabel import import_nibabel_lightly
import warp
warp.config.quiet = True
warp.init()
"""
NIBABEL = """
import_nibabel_lightly()
import nibabel.affines, nibabel.nifti1, nibabel.nifti2, nibabel.quaternions
"""
GUNZIP = """
import sys, time, {gzip}
start = time.perf_counter()
{gzip}.open(sys.argv[1]).read()
print(time.perf_counter() - start)
"""
FACTOR = 1.5
ALLOWANCE = 0.1
"""Seconds that nibabel may cost."""


def timed(*words: str, environment: dict[str, str]) -> tuple[float, str]:
    """Run a process; seconds of it all, and what it printed."""
    start = time.perf_counter()
    run = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    return time.perf_counter() - start, run.stdout


def measure(volume: Volume, isovalue: float, rounds: int) -> dict[str, list[float]]:
    """Seconds of each process, or of the decompression inside it, in each round."""
    with tempfile.TemporaryDirectory() as folder:
        scan, mesh = str(Path(folder, "scan.nii.gz")), str(Path(folder, "mesh.ply"))
        write_volume(scan, volume)
        # compiled Python is kept, as for every installed program, whatever the caller's environment says
        environment = os.environ | {"PYTHONPYCACHEPREFIX": str(Path(folder, "pycache"))}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        python = sys.executable
        words = {
            "start": ["-c", START],
            "convert": [
                "-m",
                "dmc_cli",
                "convert",
                scan,
                mesh,
                "-i",
                str(isovalue),
                "--force",
                "--device",
                "cpu",
            ],
            "decompression": ["-c", GUNZIP.format(gzip="gzip"), scan],
            "isal's": ["-c", GUNZIP.format(gzip="isal.igzip"), scan],
            "warp": ["-c", WARP],
            "with nibabel": ["-c", WARP + NIBABEL],
        }
        found: dict[str, list[float]] = {name: [] for name in words}
        for _ in range(rounds + 1):
            for name, arguments in words.items():
                took, printed = timed(python, *arguments, environment=environment)
                found[name].append(float(printed) if scan == arguments[-1] else took)
    return {name: seconds[1:] for name, seconds in found.items()}  # the first compiles and fills the caches


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--out", help="name of the history, a .jsonl in benchmarks/results")
    options = parser.parse_args()
    case = next(case for case in CASES if case.name.startswith("head CT"))
    volume = case.load()
    if volume is None:
        print(f"left out: {case.path} is absent")
        return
    found = measure(volume, case.isovalue, options.rounds)
    least = {name: min(seconds) for name, seconds in found.items()}
    goal = least["start"] + FACTOR * least["decompression"]
    nodes = " x ".join(map(str, volume.shape))
    print(f"dmc convert, {nodes} as .nii.gz to .ply, least of {options.rounds} runs, seconds")
    for name, seconds in least.items():
        print(f"  {name:<14} {seconds:.2f}")
    verdict = "met" if least["convert"] <= goal else "missed"
    print(f"  {'goal':<14} {goal:.2f}  (start + {FACTOR} x decompression): {verdict}")
    nibabel = least["with nibabel"] - least["warp"]
    verdict = "met" if nibabel <= ALLOWANCE else "missed"
    print(f"  {'nibabel':<14} {nibabel:.2f}  (allowed {ALLOWANCE}): {verdict}")
    if options.out:
        record(options.out, {"seconds": found, "goal": goal, "nibabel": nibabel})


if __name__ == "__main__":
    main()
