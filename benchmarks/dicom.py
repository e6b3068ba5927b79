"""Reading a DICOM series of 300 uncompressed slices from a warm cache, beside plain reading of its files.

    python benchmarks/dicom.py [--rounds 7] [--out NAME]

The slices are those of a real head CT; where it has fewer, they go on in the opposite order, moved to where
the next ones would lie. Rounds are interleaved; each figure is the least of its rounds. Plain reading is
opening every file and reading it into new memory, one after the other. The goal is 300 MB/s of values.
"""

import argparse
import io
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import pydicom
from cases import SHARED
from history import record
from pydicom.uid import generate_uid

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import read_volume

SLICES = 300
GOAL = 300.0
"""Megabytes of values a second."""


def make_series(archive: Path, folder: Path) -> None:
    """Write the slices of a zip, and as many more as there are to be."""
    with zipfile.ZipFile(archive) as entries:
        names = sorted(name for name in entries.namelist() if name.endswith(".dcm"))
        slices = [entries.read(name) for name in names]
    first, second = (pydicom.dcmread(io.BytesIO(slices[n])).ImagePositionPatient for n in (0, 1))
    for number in range(SLICES):
        turn, place = divmod(number, len(slices))
        content = slices[-1 - place if turn % 2 else place]
        path = folder / f"{number:04}.dcm"
        if not turn:
            path.write_bytes(content)
            continue
        dataset = pydicom.dcmread(io.BytesIO(content))
        dataset.ImagePositionPatient = [a + number * (b - a) for a, b in zip(first, second, strict=True)]
        dataset.SOPInstanceUID = dataset.file_meta.MediaStorageSOPInstanceUID = generate_uid(
            entropy_srcs=[str(number)]
        )
        dataset.save_as(path)


def read_plainly(paths: list[Path]) -> list[bytes]:
    """Read all files, one after the other."""
    return [path.read_bytes() for path in paths]


def timed(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--out", help="name of the history, a .jsonl in benchmarks/results")
    options = parser.parse_args()
    archive = SHARED / "dicom_vhf_head.zip"
    if not archive.exists():
        print(f"left out: {archive} is absent")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make_series(archive, folder)
        paths = sorted(folder.iterdir())
        values = read_volume(name, ReadSettings()).values
        megabytes = values.nbytes / 1e6
        works = {
            "dmc": lambda: read_volume(name, ReadSettings()),
            "dmc, 1 thread": lambda: read_volume(name, ReadSettings(threads=1)),
            "plain reading": lambda: read_plainly(paths),
        }
        found: dict[str, list[float]] = {work: [] for work in works}
        for _ in range(options.rounds):
            for work, function in works.items():
                found[work].append(timed(function))
    least = {work: min(seconds) for work, seconds in found.items()}
    shape = " x ".join(map(str, values.shape[::-1]))
    print(f"DICOM series, {shape} of {values.dtype} ({megabytes:.0f} MB), least of {options.rounds} rounds")
    for work, seconds in least.items():
        times = seconds / least["plain reading"]
        print(f"  {work:<14} {seconds:.3f} s  {megabytes / seconds:5.0f} MB/s  {times:4.1f} x plain reading")
    verdict = "met" if megabytes / least["dmc"] >= GOAL else "missed"
    print(f"  goal           {megabytes / GOAL:.3f} s  {GOAL:5.0f} MB/s: {verdict}")
    if options.out:
        record(options.out, {"seconds": found, "megabytes": megabytes})


if __name__ == "__main__":
    main()
