"""Pairs of a header and a data file, .hdr and .img, either of them gzipped or not."""

import gzip
import zlib
from pathlib import Path

from dmc_cli.errors import DamagedVolumeError, VolumeError
from dmc_cli.volume.layout import check_file, exists


def pair_files(path: Path) -> tuple[Path, Path]:
    """Header and data file of `path`, which may be either of a pair, gzipped or not."""
    name = path.name
    for mine, other in ((".img", ".hdr"), (".hdr", ".img")):
        for packed in ("", ".gz"):
            if not name.lower().endswith(mine + packed):
                continue
            stem = name[: len(name) - len(mine + packed)]
            names = (stem + suffix + gz for gz in (packed, "", ".gz") for suffix in (other, other.upper()))
            sibling = next(
                (path.with_name(n) for n in names if exists(path.with_name(n))), path.with_name(stem + other)
            )
            return (sibling, path) if mine == ".img" else (path, sibling)
    return path, path


def is_gzip(path: Path, name: str) -> bool:
    """Whether a file that must be there is gzipped."""
    check_file(path, name if path.name == Path(name).name else f"{name} ({path.name})")
    with path.open("rb") as file:
        return file.read(2) == b"\x1f\x8b"


def read_start(path: Path, name: str) -> bytes:
    """The first 540 decoded bytes of a file, or fewer where it ends."""
    try:
        with path.open("rb") as file:
            start = file.read(540)
        if start[:2] == b"\x1f\x8b":
            with gzip.open(path) as stream:
                start = stream.read(540)
    except (OSError, EOFError, zlib.error) as error:
        if isinstance(error, PermissionError):
            raise VolumeError(f"{name}: no permission to read it; check the file's access rights") from error
        raise DamagedVolumeError(
            f"{name}: the compressed header is damaged ({error}); get the file again"
        ) from error
    return start
