"""One damaged file through the readers: what comes out, how long it took, how much memory."""

import contextlib
import time
from pathlib import Path

from dmc_cli.errors import DmcError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes, read_volume

MOST_SECONDS = 2.0
MOST_BYTES = 512 << 20


SEVERAL = ("hdf5_meanings", "nrrd", "numpy", "tiff", "zarr")
"""Readers whose honest files may hold several volumes."""


class BrokenPromiseError(AssertionError):
    """A reader broke its promise."""


def peak_bytes():
    """Largest resident size since `reset_peak`, or 0 where the system does not tell."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:"))
    except (OSError, StopIteration):
        return 0


def reset_peak():
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def settings_for(reader):
    if reader == "raw":
        return ReadSettings(input_format="raw", shape=(8, 7, 6), dtype="int16")
    if reader in ("dicom_makers", "dicom_meanings"):
        return ReadSettings(series="1")
    return ReadSettings(volume_index=0) if reader in SEVERAL else ReadSettings()


def target_of(path, reader):
    """What a reader is given to read a file: the file, or the folder that it belongs to."""
    if reader in ("compressed", "dicom", "dicom_makers", "images", "packed_slices", "tiff_logs"):
        return path.parent
    if reader == "packed_pairs" and ".raw" in path.name:
        return next(path.parent.glob(f"{path.name[0]}.[nm]hd*"))
    if reader == "zarr":
        return next(folder for folder in path.parents if folder.suffix == ".zarr")
    return path


def try_file(path, reader):
    """Read a damaged file and check what comes of it; returns the name of the error, or `read`.

    Seconds are the processor's: on a busy machine any process may stand still for a while. A file that took
    long is tried again all the same.
    """
    for last in (False, False, True):
        outcome, seconds, taken = attempt(path, reader)
        if taken > MOST_BYTES:
            raise BrokenPromiseError(f"{reader}: took {taken >> 20} MiB ({outcome})")
        if seconds <= MOST_SECONDS:
            return outcome
        if last:
            raise BrokenPromiseError(f"{reader}: took {seconds:.1f} s ({outcome})")


def attempt(path, reader):
    """Outcome, seconds and bytes of one reading."""
    target, settings = target_of(path, reader), settings_for(reader)
    reset_peak()
    before, start = peak_bytes(), time.process_time()
    outcome = "read"
    try:
        list_volumes(str(target), settings)
        read_volume(str(target), settings)
    except DmcError as error:
        outcome = type(error).__name__
        told = str(error)
        if error.exit_status not in (2, 3, 4, 7) or len(told) > 4000 or "\n  File" in told:
            raise BrokenPromiseError(
                f"{reader}: {outcome} with status {error.exit_status}: {told[:300]!r}"
            ) from error
    except Exception as error:
        raise BrokenPromiseError(f"{reader}: {type(error).__name__}: {error}") from error
    return outcome, time.process_time() - start, peak_bytes() - before
