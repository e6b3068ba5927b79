"""The chunks of a Zarr array are looked at before zarr unpacks them: it unpacks whatever they hold.

The metadata are those of the specifications of Zarr version 2 (.zarray) and version 3 (zarr.json), and of
the codec sharding_indexed, whose files hold many chunks and a table of their places.
"""

import json
import math
import mmap
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume.unpacked_size import SLACK, passes

METADATA = ("zarr.json", ".zarray", ".zattrs", ".zgroup", ".zmetadata")

RUNS_CODE = "pickle"
"""The codec of numcodecs that runs whatever code a chunk holds."""

LEAST_FILES = 1 / 1000
"""Files a promised chunk, at least: chunks that hold nothing but the fill value may be left out."""

LARGEST_RATIO = 100_000
"""Bytes of values a stored byte, at most, of an array that is more than its fill value."""

LARGEST_CHUNK = 64
"""Times the array's own bytes that a chunk may have: what passes the array's border is stored, too."""


@dataclass(frozen=True)
class Packing:
    """How the chunks of an array are stored.

    Attributes:
        codecs: Names of what packs a chunk.
        chunk: Nodes of a chunk along each axis.
        inner: Of a file with many chunks, nodes of each of these along each axis; else None.
        index_first: Whether the table of their places is at the start of such a file, not at its end.
    """

    codecs: tuple[str, ...]
    chunk: tuple[int, ...]
    inner: tuple[int, ...] | None = None
    index_first: bool = False


def check_chunks(folder: Path, shape: tuple[int, ...], itemsize: int, name: str) -> None:
    """Refuse an array whose files cannot hold, or unpack to far more than, what its metadata promise.

    Args:
        folder: The array's own folder.
        shape: Its nodes along each axis.
        itemsize: Bytes of a value.
        name: The input, for messages.

    Raises:
        DamagedVolumeError: It is such an array, or unpacking it would run code.
    """
    packing = _packing(folder)
    if RUNS_CODE in packing.codecs:
        raise DamagedVolumeError(
            f"{name}: chunks of the codec {RUNS_CODE} found, which would run code; expected data only"
        )
    files = list(_chunk_files(folder))
    _check_promise(packing, files, shape, itemsize, name)
    expected = math.prod(packing.inner or packing.chunk) * itemsize
    for path in files:
        for piece in _pieces(path, packing):
            if any(passes(codec, piece, expected) for codec in packing.codecs):
                raise DamagedVolumeError(
                    f"{name}: chunk {path.relative_to(folder)} unpacks to more than the {expected} bytes that"
                    " are expected; get the store again"
                )


def _check_promise(
    packing: Packing, files: list[Path], shape: tuple[int, ...], itemsize: int, name: str
) -> None:
    """Refuse chunks that are far larger than the array, and an array far larger than what is stored."""
    size = math.prod(shape) * itemsize
    chunk = math.prod(packing.chunk) * itemsize
    stored = sum(path.stat().st_size for path in files)
    count = math.prod(-(-n // max(m, 1)) for n, m in zip(shape, packing.chunk, strict=True))
    if (
        chunk > LARGEST_CHUNK * size + SLACK
        or size > LARGEST_RATIO * stored + SLACK
        or len(files) + 1 < count * LEAST_FILES
    ):
        raise DamagedVolumeError(
            f"{name}: {stored} bytes in {len(files)} chunk file(s) found for an array of {shape} in {count} "
            f"chunk(s) of {packing.chunk}; the store is incomplete or its metadata are damaged; get it again"
        )


def _packing(folder: Path) -> Packing:
    """What the metadata say; zarr has found them valid."""
    if (folder / ".zarray").is_file():
        old = json.loads((folder / ".zarray").read_bytes())
        packers = [old.get("compressor"), *(old.get("filters") or [])]
        return Packing(tuple(str(c["id"]) for c in packers if c), tuple(old["chunks"]))
    new = json.loads((folder / "zarr.json").read_bytes())
    chunk = tuple(new["chunk_grid"]["configuration"]["chunk_shape"])
    names, sharding = _codec_names(new["codecs"])
    if sharding is None:
        return Packing(names, chunk)
    inner_names, _ = _codec_names(sharding["codecs"])
    return Packing(
        inner_names, chunk, tuple(sharding["chunk_shape"]), sharding.get("index_location") == "start"
    )


def _codec_names(codecs: list[Any]) -> tuple[tuple[str, ...], dict[str, Any] | None]:
    """Names of codecs without their prefix, and the configuration of the sharding codec."""
    found = [codec if isinstance(codec, dict) else {"name": codec} for codec in codecs]
    names = tuple(str(codec["name"]).removeprefix("numcodecs.") for codec in found)
    sharding = next((c["configuration"] for c in found if c["name"] == "sharding_indexed"), None)
    return names, sharding


def _chunk_files(folder: Path) -> Iterator[Path]:
    for parent, _, names in os.walk(folder):
        yield from (Path(parent, name) for name in names if name not in METADATA)


def _pieces(path: Path, packing: Packing) -> Iterator[memoryview]:
    """The packed chunks of a file, mapped: of most only the header is looked at."""
    if not path.stat().st_size:
        return
    with path.open("rb") as file:
        content = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if packing.inner is None:
        yield content
        return
    count = math.prod(n // max(m, 1) for n, m in zip(packing.chunk, packing.inner, strict=True))
    # places of 16 bytes each and, as written by every program that is known, a checksum of 4
    begin = 0 if packing.index_first else max(len(content) - 16 * count - 4, 0)
    for entry in range(begin, min(begin + 16 * count, len(content) - 15), 16):
        offset, size = (int.from_bytes(content[entry + k : entry + k + 8], "little") for k in (0, 8))
        yield content[offset : offset + size]
