"""Unpack a chunk of a Zarr array by codecs of a list, to no more than it can hold.

A codec that is not on the list is refused before a byte of a chunk is looked at: numcodecs knows some that
run code (pickle) or make other things than numbers.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.unpacked_size import Buffer, told_size, unpacked

MISSING = 'pip install "dmc-cli[zarr]" or pip install numcodecs google-crc32c'

Step = Callable[[Buffer, int], Buffer]
"""Undoes one codec: takes a packed chunk and the most bytes that may come out."""

STREAMS = ("zlib", "gzip", "bz2", "lzma")
"""Packers that Python and isal undo."""

UNPACKED_WHOLE = ("blosc", "zstd", "lz4")
"""Packers of numcodecs, whose chunks say how much they unpack to."""

FILTERS = (
    *("shuffle", "delta", "fixedscaleoffset", "quantize", "packbits", "astype", "bitround"),
    *("crc32", "adler32", "fletcher32", "jenkins_lookup3"),
)
"""Codecs of numcodecs that change values or append a checksum; none unpacks to more than `GROWTH` times."""

KNOWN = (*STREAMS, *UNPACKED_WHOLE, *FILTERS, "crc32c")

MOST_STEPS = 8
"""More codecs one after the other than anybody uses."""

GROWTH = 8
"""Times the bytes of its values that a chunk may have between two codecs."""

SLACK = 1 << 16
"""Bytes beside that."""


class NotInstalledError(UnsupportedFormatError):
    """A codec's package is missing."""


@dataclass(frozen=True)
class Packing:
    """How a chunk is stored.

    Attributes:
        dtype: Type of a value, with its byte order.
        order: The axes in the order in which they are stored, the fastest last.
        steps: What was done to the bytes, in this order.
    """

    dtype: np.dtype[Any]
    order: tuple[int, ...]
    steps: tuple[Step, ...]

    def __post_init__(self) -> None:
        """Refuse what would only take time."""
        if len(self.steps) > MOST_STEPS:
            raise ValueError(f"{len(self.steps)} codecs one after the other; expected {MOST_STEPS} at most")

    def unpack(self, content: Buffer, chunk: tuple[int, ...]) -> AnyArray:
        """Return the values of a chunk of so many nodes along each axis.

        Raises:
            ValueError: It holds more or fewer.
        """
        expected = math.prod(chunk) * self.dtype.itemsize
        most = GROWTH * expected + SLACK
        for step in reversed(self.steps):
            with np.errstate(all="ignore", divide="raise"):  # of filters that compute
                content = step(content, most)
            if memoryview(content).nbytes > most:
                raise ValueError(f"more than the {expected} bytes of its values")
        found = memoryview(content).nbytes
        if found != expected:
            raise ValueError(f"{found} bytes for the {expected} of its values")
        flat = np.frombuffer(memoryview(content).cast("B"), self.dtype)
        stored = flat.reshape([chunk[a] for a in self.order])
        return stored.transpose(np.argsort(self.order))


def checked_step(codec: str, told: dict[str, Any], name: str) -> Step:
    """Return what undoes a codec of the list.

    Args:
        codec: Its name.
        told: Its configuration, as in the metadata.
        name: The input, for messages.

    Raises:
        DamagedVolumeError: A codec that is not on the list, or a configuration that it cannot have.
        UnsupportedFormatError: Its package is missing.
    """
    if codec not in KNOWN:
        raise DamagedVolumeError(
            f"{name}: chunks of the codec {codec[:60]!r} found; expected one of "
            f"{', '.join(KNOWN)}; others may run code or hold no numbers; convert the store"
        )
    try:
        if codec in STREAMS:
            return partial(unpacked, codec, **_lzma_options(told) if codec == "lzma" else {})
        if codec == "crc32c":
            return _crc32c(str(told.get("location", "end")))
        return _by_numcodecs(codec, told)
    except ImportError as error:
        raise NotInstalledError(
            f"{name}: chunks of the codec {codec} found, but its package is missing; {MISSING}"
        ) from error


def _by_numcodecs(codec: str, told: dict[str, Any]) -> Step:
    """Return a step that numcodecs takes."""
    import numcodecs

    if codec in UNPACKED_WHOLE:
        # what packed them is told by the chunks themselves
        decode = numcodecs.get_codec({"id": codec}).decode
        return partial(_unpack_whole, codec, decode)
    for key, value in told.items():
        if (
            "type" in key
            and value is not None
            and not re.fullmatch(r"[<>|=]?[iuf][1248]|[|]?b1|u?int(8|16|32|64)|float(32|64)|bool", str(value))
        ):
            raise ValueError(f"{codec} has the type {str(value)[:40]!r}; expected a number's")
    decode = numcodecs.get_codec({**told, "id": codec}).decode
    return lambda content, most: decode(_flat(content))  # type: ignore[no-any-return]


def _flat(content: Buffer) -> AnyArray:
    return np.frombuffer(memoryview(content).cast("B"), np.uint8)


def _unpack_whole(codec: str, decode: Callable[[Any], Any], content: Buffer, most: int) -> Buffer:
    """Unpack what states its size, unless that is too large."""
    flat = memoryview(content).cast("B")
    if told_size(codec, flat) > most:
        raise ValueError(f"{told_size(codec, flat)} bytes promised by {codec}, {most} expected at most")
    return decode(flat)  # type: ignore[no-any-return]


def _crc32c(location: str) -> Step:
    """Compare and drop the checksum of four bytes at the end or the start."""
    import google_crc32c

    def step(content: Buffer, _: int) -> Buffer:
        flat = memoryview(content).cast("B")
        values, told = (flat[:-4], flat[-4:]) if location == "end" else (flat[4:], flat[:4])
        if google_crc32c.value(bytes(values)) != int.from_bytes(told, "little"):
            raise ValueError("a wrong checksum")
        return values

    return step


def _lzma_options(told: dict[str, Any]) -> dict[str, Any]:
    """Return format and filters of a codec lzma, whose dictionary must be of a size that anybody uses."""
    filters = told.get("filters")
    for each in filters or []:
        if int(each.get("dict_size", 0)) > 1 << 28:
            raise ValueError(f"lzma has a dictionary of {each['dict_size']} bytes; expected 256 MiB at most")
    return {"format": int(told.get("format", 1)), "filters": filters}
