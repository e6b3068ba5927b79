"""Read the header of NIfTI-1 (348 bytes) and NIfTI-2 (540 bytes), in either byte order.

Fields lie at the fixed places that nifti1.h and nifti2.h of the NIfTI Data Format Working Group give.
Where writers are known to leave a field out, the rules are those of the group's own nifti1_io.c: a
pixdim of 0 counts as 1, and a qfac (pixdim[0]) that is not negative as 1.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError

Matrix = np.ndarray[Any, np.dtype[np.float64]]

_FIELDS_1 = {
    "dim": ("8i2", 40),
    "datatype": ("i2", 70),
    "pixdim": ("8f4", 76),
    "vox_offset": ("f4", 108),
    "scl_slope": ("f4", 112),
    "scl_inter": ("f4", 116),
    "xyzt_units": ("u1", 123),
    "qform_code": ("i2", 252),
    "sform_code": ("i2", 254),
    "quatern": ("3f4", 256),
    "qoffset": ("3f4", 268),
    "srow": ("(3,4)f4", 280),
}
_FIELDS_2 = {
    "dim": ("8i8", 16),
    "datatype": ("i2", 12),
    "pixdim": ("8f8", 104),
    "vox_offset": ("i8", 168),
    "scl_slope": ("f8", 176),
    "scl_inter": ("f8", 184),
    "xyzt_units": ("i4", 500),
    "qform_code": ("i4", 344),
    "sform_code": ("i4", 348),
    "quatern": ("3f8", 352),
    "qoffset": ("3f8", 376),
    "srow": ("(3,4)f8", 400),
}


def _record(fields: dict[str, tuple[str, int]], size: int) -> np.dtype[Any]:
    """Return the type of a whole header, little endian."""
    kinds, offsets = zip(*fields.values(), strict=True)
    named = {"names": list(fields), "formats": kinds, "offsets": offsets, "itemsize": size}
    return np.dtype(named).newbyteorder("<")  # type: ignore[call-overload, no-any-return]


RECORDS = {348: _record(_FIELDS_1, 348), 540: _record(_FIELDS_2, 540)}
"""Type of a header by its size, which is its first number too."""

MAGICS = {348: (b"n+1", b"ni1"), 540: (b"n+2", b"ni2")}
"""What the magic bytes begin with: values in the same file, values in an .img."""

_MAGIC_PLACES = {348: 344, 540: 4}

TYPES = {
    2: "u1",
    4: "i2",
    8: "i4",
    16: "f4",
    64: "f8",
    256: "i1",
    512: "u2",
    768: "u4",
    1024: "i8",
    1280: "u8",
}
"""Codes of real numbers to NumPy's names."""

OTHER_TYPES = {
    1: "one bit",
    32: "complex64",
    128: "RGB",
    1536: "float128",
    1792: "complex128",
    2048: "complex256",
    2304: "RGBA",
}
"""Codes of what no volume holds."""


@dataclass(frozen=True)
class NiftiHeader:
    """The fields of a header that tell where values lie and what they mean.

    Attributes:
        fields: One record of `RECORDS`.
        size: Bytes of the header: 348 or 540.
        single: Whether the values follow in the same file.
    """

    fields: Any
    size: int
    single: bool

    def value_type(self, name: str) -> np.dtype[Any]:
        """Return the type of a stored value, with its byte order.

        Raises:
            UnsupportedFormatError: It is no real number's.
        """
        code = int(self.fields["datatype"])
        if code not in TYPES:
            raise UnsupportedFormatError(
                f"{name}: values of type {OTHER_TYPES.get(code, 'unknown')} (datatype code {code}) found; "
                "expected integers of 8 to 64 bits, float32 or float64; convert the volume to one of these"
            )
        return np.dtype(TYPES[code]).newbyteorder(self.fields.dtype["dim"].base.byteorder)

    def spacing(self) -> tuple[float, float, float]:
        """Return the distances of the nodes along x, y, z; 1 where the header has none."""
        x, y, z = (abs(float(s)) or 1.0 for s in self.fields["pixdim"][1:4])
        return x, y, z

    def sform(self) -> Matrix:
        """Return the affine of srow_x, srow_y, srow_z."""
        affine = np.eye(4)
        affine[:3] = self.fields["srow"]
        return affine

    def qform(self, name: str) -> Matrix:
        """Return the affine of a unit quaternion (1 - |bcd|^2)^1/2, b, c, d, spacings, qfac and offset.

        The first number is 0 where rounding may have left it, as in nifti1_io.c: half turns are common.

        Raises:
            DamagedVolumeError: The quaternion is longer than 1.
        """
        b, c, d = (float(q) for q in self.fields["quatern"])
        rest = 1.0 - (b * b + c * c + d * d)
        if not rest > -_ROUNDING:
            raise DamagedVolumeError(
                f"{name}: the header's qform has the quaternion {b:g}, {c:g}, {d:g}; expected a length of at "
                "most 1; the header is damaged"
            )
        x, y, z = self.spacing()
        affine = np.eye(4)
        rounding = 1e-7 if self.fields["quatern"].dtype.itemsize == 4 else 0.0
        affine[:3, :3] = _rotation(math.sqrt(rest) if rest > rounding else 0.0, b, c, d)
        affine[:3, :3] *= (x, y, -z if self.fields["pixdim"][0] < 0 else z)
        affine[:3, 3] = self.fields["qoffset"]
        return affine


_ROUNDING = 1e-5
"""How much the squares of a quaternion stored as three float32 may pass 1."""


def _rotation(a: float, b: float, c: float, d: float) -> Matrix:
    """Return the rotation of a quaternion that rounding may have left a little too long."""
    a, b, c, d = (q / math.sqrt(a * a + b * b + c * c + d * d) for q in (a, b, c, d))
    return np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c],
        ]
    )


def parse_nifti(start: bytes, name: str) -> NiftiHeader:
    """Return the header at the start of a file.

    Raises:
        UnsupportedFormatError: It is none of NIfTI.
        DamagedVolumeError: The file ends within it.
    """
    for order in ("<", ">"):
        size = int.from_bytes(start[:4], "little" if order == "<" else "big")
        if size not in RECORDS:
            continue
        magic = start[_MAGIC_PLACES[size] :][:3]
        if magic not in MAGICS[size]:
            continue
        if len(start) < size:
            raise DamagedVolumeError(
                f"{name}: {len(start)} bytes found, {size} expected for the header alone; get the file again"
            )
        fields = np.frombuffer(start, RECORDS[size].newbyteorder(order), 1)[0]
        return NiftiHeader(fields, size, single=magic == MAGICS[size][0])
    raise UnsupportedFormatError(
        f"{name}: no NIfTI header found (its first number is neither 348 nor 540, or the magic bytes are "
        "missing); expected NIfTI-1 or NIfTI-2; choose another reader with --input-format"
    )
