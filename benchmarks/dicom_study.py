"""`dmc info` of a study of many single-slice files from a warm cache, beside pydicom reading two tags.

    python benchmarks/dicom_study.py [--files 5000] [--rounds 3] [--out NAME]

The files are slices of 64 x 64 in volumes of 50, as functional studies have them: plain ones, ones with
100 kB of private elements, ones with sequences of unknown length. Rounds are interleaved; each figure is the
least of its rounds, that of dmc with the start of the program. The goal is 3 times what pydicom takes for two
tags of each file, and 300 MB at most.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pydicom
from history import record
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, MRImageStorage

SLICES = 50
GOAL = 3.0
"""Times what pydicom takes."""
GOAL_MB = 300
KINDS = {"plain": (0, False), "private": (50_000, False), "sequences": (0, True)}
"""Bytes of each of two private elements, and whether there are sequences of unknown length."""


def make_dataset(private: int, has_sequences: bool) -> Dataset:
    """Return a slice with all that the files share."""
    dataset = Dataset()
    dataset.file_meta = FileMetaDataset()
    dataset.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    fields = {
        "ImageType": ["ORIGINAL", "PRIMARY", "M"],
        "SOPClassUID": MRImageStorage,
        "Modality": "MR",
        "SeriesInstanceUID": "1.2.3",
        "SeriesNumber": "1",
        "EchoTime": "30",
        "RepetitionTime": "2000",
        "ImageOrientationPatient": [1, 0, 0, 0, 1, 0],
        "PixelSpacing": [3, 3],
        "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2",
        "Rows": 64,
        "Columns": 64,
        "BitsAllocated": 16,
        "BitsStored": 12,
        "HighBit": 11,
        "PixelRepresentation": 0,
        "PixelData": np.arange(64 * 64, dtype="<u2").tobytes(),
    }
    for keyword, value in fields.items():
        setattr(dataset, keyword, value)
    dataset["PixelData"].VR = "OW"
    if private:
        block = dataset.private_block(0x0029, "SIEMENS CSA HEADER", create=True)
        block.add_new(0x10, "OB", bytes(private))
        block.add_new(0x20, "OB", bytes(private))
    if has_sequences:
        item = Dataset()
        item.CodeValue, item.is_undefined_length_sequence_item = "1", True
        for name in ("ReferencedImageSequence", "ProcedureCodeSequence", "RequestAttributesSequence"):
            setattr(dataset, name, Sequence([Dataset(item), Dataset(item)]))
            dataset[name].is_undefined_length = True
    return dataset


def make_study(folder: Path, count: int, private: int, has_sequences: bool) -> None:
    """Write so many files, in volumes of SLICES."""
    dataset = make_dataset(private, has_sequences)
    for number in range(count):
        volume, place = divmod(number, SLICES)
        uid = f"1.2.3.{number + 1}"
        dataset.SOPInstanceUID = dataset.file_meta.MediaStorageSOPInstanceUID = uid
        dataset.InstanceNumber = str(number + 1)
        dataset.ImagePositionPatient = [-96, -96, 3 * place]
        dataset.TemporalPositionIdentifier = str(volume + 1)
        dataset.AcquisitionTime = f"10{number // 600 % 60:02}{number // 10 % 60:02}.{number % 10}"
        dataset.save_as(folder / f"{number:05}.dcm", enforce_file_format=True)


def read_two_tags(folder: Path) -> float:
    """Return the seconds in which pydicom reads two tags of each file."""
    start = time.perf_counter()
    for path in sorted(folder.iterdir()):
        pydicom.dcmread(
            path, stop_before_pixels=True, specific_tags=["SeriesInstanceUID", "ImagePositionPatient"]
        )
    return time.perf_counter() - start


def list_study(folder: Path) -> tuple[float, float]:
    """Return the seconds and the largest resident megabytes of `dmc info`, in a process of its own."""
    command = [sys.executable, "-m", "dmc_cli", "info", str(folder)]
    watch = (
        "import resource, subprocess, sys;"
        "subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True);"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    start = time.perf_counter()
    told = subprocess.run([sys.executable, "-c", watch, *command], capture_output=True, text=True, check=True)
    unit = 1 if sys.platform == "darwin" else 1024
    return time.perf_counter() - start, int(told.stdout) * unit / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--files", type=int, default=5000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--out", help="name of the history, a .jsonl in benchmarks/results")
    options = parser.parse_args()
    found: dict[str, dict[str, list[float]]] = {}
    print(f"dmc info of {options.files} files, least of {options.rounds} rounds")
    for kind, (private, has_sequences) in KINDS.items():
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            make_study(folder, options.files, private, has_sequences)
            rounds = [(read_two_tags(folder), *list_study(folder)) for _ in range(options.rounds)]
        pydicom_seconds, seconds, megabytes = map(list, zip(*rounds, strict=True))
        found[kind] = {"dmc": seconds, "pydicom": pydicom_seconds, "megabytes": megabytes}
        times, peak = min(seconds) / min(pydicom_seconds), max(megabytes)
        verdict = "met" if times <= GOAL and peak <= GOAL_MB else "missed"
        print(
            f"  {kind:<10} {min(seconds):.2f} s, {times:.2f} x pydicom's two tags, {peak:.0f} MB: {verdict}"
        )
    if options.out:
        record(options.out, {"seconds": found, "files": options.files})


if __name__ == "__main__":
    main()
