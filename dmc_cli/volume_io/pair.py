"""Open pairs of a header and a data file, such as .hdr and .img, either of them packed or not."""

from pathlib import Path

from dmc_cli.errors import VolumeError
from dmc_cli.volume_io.layout import check_file, exists
from dmc_cli.volume_io.packed import SUFFIXES, inner_name
from dmc_cli.volume_io.within import check_beside

PAIRS = ((".hdr", ".img"), (".head", ".brik"), (".par", ".rec"))
"""Suffixes of headers and of their data files: NIfTI and Analyze, AFNI, Philips."""

DETACHED = (".nhdr", ".mhd", *(suffix for pair in PAIRS for suffix in pair))
"""Suffixes of files that need others beside them, so that they are read where they are, packed or not."""


def is_detached(path: Path) -> bool:
    """Return whether a file's name, packed or not, means one that needs others beside it."""
    return inner_name(path.name).lower().endswith(DETACHED)


def pair_files(path: Path) -> tuple[Path, Path]:
    """Return the header and data file of `path`, which may be either of a pair, packed or not."""
    name = path.name
    for mine, other in (*PAIRS, *(pair[::-1] for pair in PAIRS)):
        for packed in ("", *SUFFIXES):
            if not name.lower().endswith(mine + packed):
                continue
            stem = name[: len(name) - len(mine + packed)]
            is_upper = name[len(stem) :].startswith(mine.upper())
            cases = (other.upper(), other) if is_upper else (other, other.upper())
            packings = dict.fromkeys((packed, "", *SUFFIXES))
            names = (stem + suffix + packing for packing in packings for suffix in cases)
            sibling = next(
                (path.with_name(n) for n in names if exists(path.with_name(n))),
                path.with_name(stem + cases[0]),
            )
            return (path, sibling) if (mine, other) in PAIRS else (sibling, path)
    return path, path


def checked_pair(path: Path, name: str, allow_outside: bool) -> tuple[Path, Path]:
    """Return the header and data file of `path`.

    Raises:
        VolumeError: There is no header, or the other one lies elsewhere and `allow_outside` is not set.
        DamagedVolumeError: The header is empty.
    """
    header, data = pair_files(path)
    for file in (header, data):
        if file != path and exists(file):
            check_beside(path, file, file.name, name, allow_outside)
    if header != path and not exists(header):
        raise VolumeError(f"{name}: its header {header.name} is not there; put it beside the data file")
    check_file(header, name)
    return header, data
