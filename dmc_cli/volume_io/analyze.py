"""Read Analyze 7.5 and its SPM variants: .hdr and .img (gzipped too); no space, with a warning.

The format tells no orientation: programs that use it disagree on left and right. SPM's scale factor
is applied, as nibabel and SPM do.
"""

import math
import struct
from pathlib import Path

import numpy as np

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume.checks import check_shape
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import Layout, chosen_index, scale_affine
from dmc_cli.volume_io.pair import checked_pair, is_gzip

HEADER_BYTES = 348

TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 130: "i1", 132: "u2", 136: "u4"}
"""Codes of real numbers to NumPy's names; the last three are SPM's."""

NO_ORIENTATION = "Analyze files tell no orientation; axes and origin are the grid's own, left may be right"


def analyze_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of the volume `settings.volume_index` of an Analyze pair.

    Raises:
        UnsupportedFormatError: No Analyze header, or values that are not single real numbers.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    header_path, data_path = checked_pair(path, name, settings.allow_outside)
    start = first_bytes(header_path, name, HEADER_BYTES)
    order = next((o for o in "<>" if start[:4] == struct.pack(f"{o}i", HEADER_BYTES)), None)
    if order is None or len(start) < HEADER_BYTES:
        raise UnsupportedFormatError(
            f"{name}: no Analyze header found (348 bytes that begin with their number); "
            "choose another reader with --input-format"
        )
    dim = struct.unpack_from(f"{order}8h", start, 40)
    code, _ = struct.unpack_from(f"{order}2h", start, 70)
    pixdim = struct.unpack_from(f"{order}8f", start, 76)
    offset, slope, intercept = struct.unpack_from(f"{order}3f", start, 108)
    sizes = dim[1 : dim[0] + 1] if 3 <= dim[0] <= 7 else ()
    if not sizes or any(n < 1 for n in sizes):
        raise DamagedVolumeError(
            f"{name}: axes of {dim} nodes found; expected three or more positive numbers"
        )
    shape = sizes[0], sizes[1], sizes[2]
    check_shape(name, shape)
    if code not in TYPES:
        raise UnsupportedFormatError(f"{name}: datatype code {code} found; expected a real number's")
    if not math.isfinite(offset) or abs(offset) > 2**40:
        raise DamagedVolumeError(f"{name}: vox_offset is {offset:g}; expected a position in the file")
    volumes = math.prod(sizes[3:])
    is_scaled = math.isfinite(slope) and slope != 0
    return Layout(
        name=name,
        shape=shape,
        dtype=np.dtype(order + TYPES[code]),
        affine=scale_affine((abs(pixdim[1]), abs(pixdim[2]), abs(pixdim[3])), (0.0, 0.0, 0.0)),
        space="none",
        files=(data_path,),
        offset=int(abs(offset)),
        encoding="gzip" if is_gzip(data_path, name) else "raw",
        volumes=volumes,
        volume=chosen_index(name, volumes, settings.volume_index),
        slope=slope if is_scaled else 1.0,
        intercept=intercept if is_scaled and math.isfinite(intercept) else 0.0,
        format="analyze",
        warnings=(NO_ORIENTATION,),
    )
