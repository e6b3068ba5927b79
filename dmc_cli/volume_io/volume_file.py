"""Write a synthetic volume as a file of a common format, for other programs and for trials.

Such a volume has float32 values along the axes of no space. They are written little endian. Raw keeps
neither shape nor geometry. NIfTI has no way to place a volume without naming its axes: it is written as RAS
(sform code 2, aligned).
"""

import struct
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from dmc_cli.errors import SettingsError
from dmc_cli.files import write_output
from dmc_cli.settings import STREAM, VolumeFormat
from dmc_cli.volume import Volume

SUFFIXES: dict[str, VolumeFormat] = {
    ".nii": "nifti",
    ".nii.gz": "nifti",
    ".nrrd": "nrrd",
    ".mha": "meta",
    ".raw": "raw",
}

_NIFTI_OFFSET = 352
"""Where the values of a single-file NIfTI begin: header, then four bytes that say "no extension"."""


def choose_volume_format(path: str, output_format: VolumeFormat | None = None) -> VolumeFormat:
    """Return the format asked for, else the one that the suffix tells.

    Raises:
        SettingsError: The suffix is of no format, or there is none.
    """
    if output_format is not None:
        return output_format
    for suffix, name in SUFFIXES.items():
        if path.lower().endswith(suffix):
            return name
    found = "standard output has no suffix" if path == STREAM else f"{path} has no suffix that is known"
    raise SettingsError(f"{found}; expected one of {', '.join(SUFFIXES)}; or name it with --output-format")


def write_volume(
    path: str, volume: Volume, *, output_format: VolumeFormat | None = None, force: bool = False
) -> int:
    """Write a volume completely or not at all and return the number of bytes.

    Raises:
        SettingsError: The format is not known.
        WriteError: The file exists, or it cannot be written; an older file is untouched.
    """
    name = choose_volume_format(path, output_format)
    chunks = _chunks(_HEADERS[name](volume), volume)
    if path.lower().endswith(".gz"):
        chunks = _compressed(chunks)
    return write_output(path, chunks, force=force)


def _chunks(header: bytes, volume: Volume) -> Iterator[bytes]:
    """Yield the header, then the values slice by slice."""
    yield header
    for plane in volume.values:
        yield plane.astype("<f4", copy=False).tobytes()


def _compressed(chunks: Iterator[bytes]) -> Iterator[bytes]:
    """Yield the chunks as one gzip member, without a name or a time."""
    deflate = zlib.compressobj(level=6, wbits=31)
    for chunk in chunks:
        yield deflate.compress(chunk)
    yield deflate.flush()


def _raw_header(_volume: Volume) -> bytes:
    return b""


def _nrrd_header(volume: Volume) -> bytes:
    """Write an NRRD header; of the space its dimension is told."""
    directions = " ".join(f"({_joined(volume.affine[:3, axis], ',')})" for axis in range(3))
    lines = [
        "NRRD0005",
        "type: float",
        "dimension: 3",
        "space dimension: 3",
        f"sizes: {_joined(volume.shape)}",
        f"space directions: {directions}",
        f"space origin: ({_joined(volume.affine[:3, 3], ',')})",
        "endian: little",
        "encoding: raw\n\n",
    ]
    return "\n".join(lines).encode("ascii")


def _meta_header(volume: Volume) -> bytes:
    """Write a MetaImage header; its world is LPS by convention."""
    lines = [
        "ObjectType = Image",
        "NDims = 3",
        "BinaryData = True",
        "BinaryDataByteOrderMSB = False",
        "CompressedData = False",
        f"TransformMatrix = {_joined(np.eye(3).ravel())}",
        f"Offset = {_joined(volume.affine[:3, 3])}",
        f"ElementSpacing = {_joined(volume.spacing)}",
        f"DimSize = {_joined(volume.shape)}",
        "ElementType = MET_FLOAT",
        "ElementDataFile = LOCAL\n",
    ]
    return "\n".join(lines).encode("ascii")


def _nifti_header(volume: Volume) -> bytes:
    """Write the 348 bytes of a NIfTI-1 header and its empty extension flag."""
    header = bytearray(_NIFTI_OFFSET)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *volume.shape, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 16, 32)  # float32, which has 32 bits
    struct.pack_into("<8f", header, 76, 1.0, *volume.spacing, 0.0, 0.0, 0.0, 0.0)
    struct.pack_into("<3f", header, 108, _NIFTI_OFFSET, 1.0, 0.0)  # slope and intercept
    header[123] = 2  # xyzt_units: millimetres
    struct.pack_into("<2h", header, 252, 0, 2)  # qform unknown, sform aligned
    struct.pack_into("<12f", header, 280, *volume.affine[:3].ravel())
    header[344:348] = b"n+1\0"
    return bytes(header)


def _joined(numbers: Any, separator: str = " ") -> str:
    """Write numbers with the shortest decimals that read back the same."""
    return separator.join(repr(number) for number in np.asarray(numbers).tolist())


_HEADERS: dict[VolumeFormat, Callable[[Volume], bytes]] = {
    "nifti": _nifti_header,
    "nrrd": _nrrd_header,
    "meta": _meta_header,
    "raw": _raw_header,
}
