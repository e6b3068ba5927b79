"""Read Analyze 7.5 and its SPM variants: .hdr and .img (packed too); no space, with a warning.

The format tells no orientation: programs that use it disagree on left and right. SPM's scale factor
is applied, as nibabel, whose class for SPM2 reads the header, and SPM do.
"""

import math
from pathlib import Path
from typing import Any

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.axes import Axis, chosen_volume, flat_index, listed_volumes, stacked_image
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import Layout, scale_affine
from dmc_cli.volume_io.lengths import settled_affine
from dmc_cli.volume_io.nibabel_headers import negative_lengths, scaling, value_type
from dmc_cli.volume_io.pair import checked_pair
from dmc_cli.volume_io.units import scales_in_mm

HEADER_BYTES = 348

NO_ORIENTATION = "Analyze files tell no orientation; axes and origin are the grid's own, left may be right"


def analyze_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of the chosen volume of an Analyze pair.

    Raises:
        UnsupportedFormatError: No Analyze header, or values that are not single real numbers.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    from nibabel.spm2analyze import Spm2AnalyzeHeader

    header_path, data_path = checked_pair(path, name, settings.allow_outside)
    start = first_bytes(header_path, name, HEADER_BYTES)
    if not Spm2AnalyzeHeader.may_contain_header(start):
        raise UnsupportedFormatError(
            f"{name}: no Analyze header found (348 bytes that begin with their number); "
            "choose another reader with --input-format"
        )
    order = "little" if int.from_bytes(start[:4], "little") == HEADER_BYTES else "big"
    header = Spm2AnalyzeHeader(start, order, check=False)
    dim = header["dim"].tolist()
    sizes = dim[1 : dim[0] + 1] if 3 <= dim[0] <= 7 else ()
    if not sizes or any(n < 1 for n in sizes):
        raise DamagedVolumeError(
            f"{name}: axes of {tuple(dim)} nodes found; expected three or more positive numbers"
        )
    shape = sizes[0], sizes[1], sizes[2]
    check_shape(name, shape)
    offset = float(header["vox_offset"])
    if not math.isfinite(offset) or abs(offset) > 2**40:
        raise DamagedVolumeError(f"{name}: vox_offset is {offset:g}; expected a position in the file")
    names = ("time", "axis 5", "axis 6", "axis 7")  # the fourth is that of time points
    others = [Axis(label, n) for label, n in zip(names, sizes[3:], strict=False)]
    image = stacked_image(shape, *reversed(others))
    choice = chosen_volume([image], settings, name)
    affine, told = _affine(header, settings, name)
    slope, intercept, told_of_scale = scaling(header)
    return Layout(
        name=name,
        shape=shape,
        dtype=value_type(header, name),
        affine=affine,
        space="none",
        files=(data_path,),
        offset=int(abs(offset)),
        volumes=math.prod(sizes[3:]),
        volume=flat_index(image, choice),
        listed=listed_volumes([image], settings, name),
        slope=slope,
        intercept=intercept,
        format="analyze",
        warnings=(Notice("W-ORIENTATION-MISSING", NO_ORIENTATION), *told, *told_of_scale),
    )


def _affine(header: Any, settings: ReadSettings, name: str) -> tuple[Float64Array, tuple[Notice, ...]]:
    """Return the affine in millimetres, and what is told of its unit.

    The format's own unit is the millimetre, which most headers do not repeat in vox_units.
    """
    unit = bytes(header["vox_units"]).rstrip(b"\0 ").decode("latin-1")
    (scale, *_), doubts = scales_in_mm([unit or "mm"] * 3, name, "the header")
    x, y, z = (scale * abs(header["pixdim"][1:4]).astype(float)).tolist()
    affine, told = settled_affine(scale_affine((x, y, z), (0.0, 0.0, 0.0)), doubts, settings)
    return affine, (*told, *negative_lengths(header))
