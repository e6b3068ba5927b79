"""Unpack the chunks of a Zarr array: found in its folder, looked at, unpacked side by side.

Files are looked at and not the grid: an array may promise any number of chunks that are not there.
"""

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import DamagedVolumeError, DmcError, VolumeError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.system import usable_cores
from dmc_cli.threads import each_in_threads
from dmc_cli.volume_io.unpacked_size import SLACK
from dmc_cli.volume_io.within import Bounds, Walk
from dmc_cli.volume_io.zarr.metadata import Sharding, ZarrArray

LEAST_FILES = 1 / 1000
"""Files a promised chunk, at least: chunks that hold nothing but the fill value may be left out."""

LARGEST_RATIO = 100_000
"""Bytes of values a stored byte, at most, of an array that is more than its fill value."""

LARGEST_CHUNK = 64
"""Times the array's own bytes that a chunk may have: what passes the array's border is stored, too."""

ABSENT = (1 << 64) - 1
"""Offset and size, in the table of a file with many chunks, of one that is not there."""


@dataclass(frozen=True)
class ChunkFile:
    """A file with a chunk, or with many.

    Attributes:
        key: Its name below the array's folder.
        place: Its place in the grid of files.
        size: Its bytes.
    """

    key: str
    place: tuple[int, ...]
    size: int


def chunk_files(folder: Path, array: ZarrArray, bounds: Bounds, name: str) -> list[ChunkFile]:
    """Return the array's chunk files in the order of their places.

    Args:
        folder: The array's own folder.
        array: Its metadata.
        bounds: Where the store's files may lie.
        name: The input, for messages.

    Raises:
        VolumeError: Something in the folder is not to be read, or cannot be.
        DamagedVolumeError: The files cannot hold what the metadata promise.
    """
    walk = Walk(folder, bounds)
    found = [(key, status.st_size) for key, status in walk.files()]
    if walk.skipped:
        key, reason = walk.skipped[0]
        raise VolumeError(f"{name}: {key} is not read: {reason}; expected chunks in the store's own folder")
    placed = ((key, array.place_of(key), size) for key, size in found)
    files = [ChunkFile(key, place, size) for key, place, size in placed if place is not None]
    _check_promise(array, files, name)
    return sorted(files, key=lambda file: file.place)


def _check_promise(array: ZarrArray, files: list[ChunkFile], name: str) -> None:
    """Refuse chunks that are far larger than the array, and an array far larger than what is stored."""
    itemsize = array.packing.dtype.itemsize
    size = math.prod(array.shape) * itemsize
    chunk = math.prod(array.chunk) * itemsize
    stored = sum(file.size for file in files)
    count = math.prod(array.grid)
    if (
        chunk > LARGEST_CHUNK * size + SLACK
        or size > LARGEST_RATIO * stored + SLACK
        or len(files) + 1 < count * LEAST_FILES
    ):
        raise DamagedVolumeError(
            f"{name}: {stored} bytes in {len(files)} chunk file(s) found for an array of {array.shape} in "
            f"{count} chunk(s) of {array.chunk}; the store is incomplete or its metadata are damaged; get it "
            "again"
        )


@dataclass(frozen=True)
class ChunkReader:
    """What unpacks the chunks of one volume of an array.

    Attributes:
        folder: The array's own folder.
        array: Its metadata.
        where: The volume's place along each axis; None for those of its grid.
        values: The volume, its axes in the order of the array's, filled here.
        name: The input, for messages.
    """

    folder: Path
    array: ZarrArray
    where: tuple[int | None, ...]
    values: AnyArray
    name: str

    def read(self, files: list[ChunkFile], threads: int | None, progress: Progress) -> None:
        """Fill the volume: with the chunks of these files that belong to it, else with the fill value.

        Raises:
            DamagedVolumeError: A chunk cannot be unpacked.
        """
        self.values[...] = self.array.fill
        wanted = [file for file in files if self._is_of_volume(file.place, self.array.chunk)]
        chunks = each_in_threads(self._read_file, wanted, threads or usable_cores(), "dmc-chunks")
        with closing(chunks):
            # in the files' order, so that of several errors always the same one is told
            for done, _ in enumerate(chunks, 1):
                progress.advance(done / len(wanted))

    def _read_file(self, file: ChunkFile) -> None:
        try:
            with (self.folder / file.key).open("rb") as stream:
                if self.array.sharding is None:
                    self._put(file.place, self.array.chunk, self._piece(stream, 0, file.size))
                    return
                for place, offset, size in self._table(stream, file, self.array.sharding):
                    self._put(place, self.array.sharding.chunk, self._piece(stream, offset, size))
        except DmcError:
            raise
        except Exception as error:
            # each codec has errors of its own
            told = " ".join(str(error).split())[:200]
            raise DamagedVolumeError(
                f"{self.name}: chunk {file.key} cannot be read ({told}); get the store again"
            ) from error

    def _piece(self, stream: BinaryIO, offset: int, size: int) -> bytes:
        """Return the bytes of a chunk, which cannot be far more than its values."""
        chunk = self.array.sharding.chunk if self.array.sharding else self.array.chunk
        expected = math.prod(chunk) * self.array.packing.dtype.itemsize
        if size > 2 * expected + SLACK:
            raise ValueError(f"{size} bytes for the {expected} of its values")
        stream.seek(offset)
        return stream.read(size)

    def _table(
        self, stream: BinaryIO, file: ChunkFile, sharding: Sharding
    ) -> Iterator[tuple[tuple[int, ...], int, int]]:
        """Place, offset and size of each chunk of a file that is there and in the volume."""
        counts = [n // m for n, m in zip(self.array.chunk, sharding.chunk, strict=True)]
        length = 16 * math.prod(counts)
        whole = length + (4 if sharding.has_checksum else 0)
        if whole > file.size:
            raise ValueError(f"{file.size} bytes for a table of {whole}")
        stream.seek(0 if sharding.index_first else file.size - whole)
        content = stream.read(whole)
        if sharding.has_checksum:
            _check_table(content)
        order = "<" if sharding.index_order == "little" else ">"
        table = np.frombuffer(content[:length], f"{order}u8").reshape(-1, 2)
        for number in np.flatnonzero((table != ABSENT).any(axis=1)):
            inner = np.unravel_index(int(number), counts)
            place = tuple(int(p * n + i) for p, n, i in zip(file.place, counts, inner, strict=True))
            offset, size = (int(n) for n in table[number])
            if offset + size > file.size:
                raise ValueError(f"{offset + size} bytes promised, {file.size} found")
            if self._is_wanted(place, sharding.chunk):
                yield place, offset, size

    def _is_wanted(self, place: tuple[int, ...], chunk: tuple[int, ...]) -> bool:
        """Return whether a chunk holds a part of the volume."""
        return self._is_of_volume(place, chunk) and all(
            p * n < m for p, n, m in zip(place, chunk, self.array.shape, strict=True)
        )

    def _is_of_volume(self, place: tuple[int, ...], chunk: tuple[int, ...]) -> bool:
        """Return whether a chunk is where the volume is along the axes that are not its grid's."""
        return all(w is None or w // n == p for w, n, p in zip(self.where, chunk, place, strict=True))

    def _put(self, place: tuple[int, ...], chunk: tuple[int, ...], content: bytes) -> None:
        """Unpack a chunk to its place; what passes the array's border is dropped."""
        values = self.array.packing.unpack(content, chunk)
        axes = list(zip(place, chunk, self.where, strict=True))
        picked = values[tuple(slice(None) if w is None else w % n for _, n, w in axes)]
        target = self.values[tuple(slice(p * n, p * n + n) for p, n, w in axes if w is None)]
        target[...] = picked[tuple(slice(0, n) for n in target.shape)]


def stored_line(folder: Path, array: ZarrArray, bounds: Bounds, name: str) -> Float64Array:
    """Return the numbers of a small array of one axis, shape (n,), scaled as its attributes say.

    Raises:
        DamagedVolumeError: They cannot be read.
    """
    files = chunk_files(folder, array, bounds, name)
    values = np.empty(array.shape, array.packing.dtype.newbyteorder("="))
    ChunkReader(folder, array, (None,), values, name).read(files, 1, SILENT)
    slope, intercept = array.scale
    return np.asarray(slope * values.astype(np.float64) + intercept)


def _check_table(content: bytes) -> None:
    import google_crc32c

    if google_crc32c.value(content[:-4]) != int.from_bytes(content[-4:], "little"):
        raise ValueError("a wrong checksum of its table")
