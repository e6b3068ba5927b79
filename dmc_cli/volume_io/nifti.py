"""Read NIfTI-1 and NIfTI-2: .nii and pairs of .hdr and .img, packed or not; world axes RAS.

Headers are nibabel's. The affine is the sform's, else the qform's. With both codes 0 the header tells no
orientation: then x = pixdim * index with origin 0 and no space (nibabel would centre and flip the volume),
with a warning. Where writers are known to leave a field out, the rules are those of nifti1_io.c, which the
NIfTI Data Format Working Group gives, and not nibabel's: a pixdim of 0 counts as 1, and a qfac (pixdim[0])
that is not negative as 1.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Space, check_affine, check_shape
from dmc_cli.volume_io.axes import Image, chosen_volume, flat_index, listed_volumes
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import Layout, scale_affine
from dmc_cli.volume_io.lengths import missing_spacing, settled_affine
from dmc_cli.volume_io.nibabel_headers import negative_lengths, scaling, value_type
from dmc_cli.volume_io.nifti_intents import named_axes
from dmc_cli.volume_io.nifti_labels import extension_labels
from dmc_cli.volume_io.pair import checked_pair
from dmc_cli.volume_io.units import scales_in_mm

HEADER_BYTES = 348, 540
"""Sizes of the headers of NIfTI-1 and NIfTI-2, which are their first numbers, too."""

UNITS = {1: 1e3, 2: 1.0, 3: 1e-3}
"""Lower three bits of xyzt_units to millimetres: metre, millimetre, micrometre; 0 is unknown."""

UNIT_NAMES = {1: "metre", 2: "millimetre", 3: "micrometre"}

NO_ORIENTATION = (
    "the header tells no orientation (sform and qform codes are 0); axes and origin are the grid's own"
)

_SAME_LENGTH = 1e-3
"""Part of a distance by which a sform and pixdim may differ: writers round pixdim to a few digits."""

_SAME_DIRECTION = 0.9
"""Cosine of the angle between axes of a sform and a qform, at least: a qform has no shear."""

_NEAREST_MM, _FARTHEST_MM = 1e-5, 50.0
"""Distances of nodes, in millimetres, that a header's unit can lead to without a doubt."""

_TOO_LONG = 1e-5
"""How much the squares of a quaternion stored as three float32 may pass 1."""

_HALF_TURN = {348: 1e-7, 540: 0.0}
"""What rounding leaves of 1 at a half turn, which is common: where no more is left, nifti1_io.c takes 0."""


def nifti_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of the volume `settings.volume_index` of a NIfTI file or pair.

    Raises:
        UnsupportedFormatError: No NIfTI file, or values that are not single real numbers.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    header_path, data_path = checked_pair(path, name, settings.allow_outside)
    header = _header(first_bytes(header_path, name, max(HEADER_BYTES)), name)
    image = _grid(header, name)
    choice = chosen_volume([image], settings, name)
    affine, space, notes = _affine(header, settings, name)
    slope, intercept, told_of_scale = scaling(header)
    values_path = header_path if header.is_single else data_path
    return Layout(
        name=name,
        shape=image.nodes,
        dtype=value_type(header, name),
        affine=affine,
        space=space,
        files=(values_path,),
        offset=_offset(header, name),
        volumes=math.prod(image.axes[axis].size for axis in image.others),
        volume=flat_index(image, choice),
        listed=listed_volumes([image], settings, name),
        slope=slope,
        intercept=intercept,
        format="nifti",
        warnings=(*notes, *told_of_scale),
        labels=extension_labels(header_path, name, header.sizeof_hdr, _offset(header, name)),
    )


def _header(start: bytes, name: str) -> Any:
    """Return the header at the start of a file, of one of nibabel's four classes.

    Raises:
        UnsupportedFormatError: It is none of NIfTI.
        DamagedVolumeError: The file ends within it.
    """
    from nibabel.nifti1 import Nifti1Header, Nifti1PairHeader
    from nibabel.nifti2 import Nifti2Header, Nifti2PairHeader

    magics = {348: slice(344, 347), 540: slice(4, 7)}
    classes = {b"n+1": Nifti1Header, b"ni1": Nifti1PairHeader, b"n+2": Nifti2Header, b"ni2": Nifti2PairHeader}
    for order in ("little", "big"):
        size = int.from_bytes(start[:4], order)
        if size not in magics:
            continue
        if len(start) < size:
            raise DamagedVolumeError(
                f"{name}: {len(start)} bytes found, {size} expected for the header alone; get the file again"
            )
        found = classes.get(start[magics[size]])
        if found is None or found.sizeof_hdr != size:
            continue
        return found(start[:size], order, check=False)  # what is wrong is told or mended here
    raise UnsupportedFormatError(
        f"{name}: no NIfTI header found (its first number is neither 348 nor 540, or the magic bytes are "
        "missing); expected NIfTI-1 or NIfTI-2; choose another reader with --input-format"
    )


def _grid(header: Any, name: str) -> Image:
    """Return the axes: x, y, z and the time, the components of vectors, and two that nobody names."""
    dim = header["dim"].tolist()
    if not 1 <= dim[0] <= 7:
        raise DamagedVolumeError(
            f"{name}: {dim[0]} axes found in the header; expected 1 to 7; the header is damaged"
        )
    sizes = dim[1 : dim[0] + 1]
    sizes = sizes[:3] + [n or 1 for n in sizes[3:]]  # an axis that is not used, as nifti1_io.c has it
    sizes += [1] * (3 - len(sizes))
    if any(n < 1 for n in sizes):
        raise DamagedVolumeError(
            f"{name}: axes of {sizes} nodes found; expected positive numbers; the header is damaged"
        )
    check_shape(name, (sizes[0], sizes[1], sizes[2]))
    return Image(tuple(reversed(named_axes(header, sizes))))


def _offset(header: Any, name: str) -> int:
    """Return where the values begin in their file."""
    offset = float(header["vox_offset"])
    if not math.isfinite(offset) or offset < 0 or offset > 2**40:
        raise DamagedVolumeError(
            f"{name}: vox_offset is {offset:g}; expected a position in the file; the header is damaged"
        )
    return max(int(offset), header.single_vox_offset if header.is_single else 0)


def _affine(header: Any, settings: ReadSettings, name: str) -> tuple[Float64Array, Space, tuple[Notice, ...]]:
    """Return the affine in millimetres, its space, and warnings."""
    unit = int(header["xyzt_units"]) & 7
    doubts: tuple[Notice, ...] = ()
    if unit == 0:
        _, doubts = scales_in_mm([None] * 3, name, "the header")
    elif unit not in UNITS:
        sentence = f"the header's unit of length has the unknown code {unit}; taken as millimetres"
        doubts = (Notice("W-UNIT-UNKNOWN", f"{sentence}; --spacing tells better"),)
    if header["sform_code"] <= 0:
        lengths = zip("xyz", header["pixdim"][1:4], strict=True)
        missing = {axis: UNITS.get(unit, 1.0) for axis, length in lengths if length == 0}
        doubts = (*missing_spacing(missing, "the header"), *doubts)
    with np.errstate(all="ignore"):  # what is not finite is refused with the layout
        affine, space, notes = _form(header, name)
        affine[:3] *= UNITS.get(unit, 1.0)
        doubts += _doubtful_unit(affine, unit)
    affine, told = settled_affine(affine, doubts, settings)
    return affine, space, notes + told


def _form(header: Any, name: str) -> tuple[Float64Array, Space, tuple[Notice, ...]]:
    """Return the affine in the header's unit by its sform, else its qform, else its spacing alone.

    A sform that is flat (all of it is 0, in most such files) gives way to a qform, as in ITK; one that is not
    finite is damaged. Slice timing and dim_info tell nothing of where nodes lie.
    """
    if header["sform_code"] > 0:
        affine = header.get_sform()
        if header["qform_code"] > 0 and np.isfinite(affine).all() and _is_flat(affine):
            told = "the header's sform is flat, its axes do not span the space; the qform is taken"
            return _qform(header, name), "RAS", (Notice("W-GEOMETRY-CONTRADICTED", told),)
        return affine, "RAS", (*_contradiction(affine, header), *_other_qform(affine, header, name))
    if header["qform_code"] > 0:
        return _qform(header, name), "RAS", negative_lengths(header)
    unturned = scale_affine(_spacing(header), (0.0, 0.0, 0.0))
    return unturned, "none", (Notice("W-ORIENTATION-MISSING", NO_ORIENTATION), *negative_lengths(header))


def _other_qform(affine: Float64Array, header: Any, name: str) -> tuple[Notice, ...]:
    """Return a warning where the qform lies elsewhere than the sform, though both tell the same world.

    With other codes it may be another world, but never one that is the mirror image.
    """
    if header["qform_code"] <= 0 or not np.isfinite(affine).all():
        return ()
    try:
        other = _qform(header, name)
    except DamagedVolumeError:
        return ()
    lengths, others = (np.linalg.norm(form[:3, :3], axis=0) for form in (affine, other))
    cosines = (affine[:3, :3] * other[:3, :3]).sum(axis=0) / (lengths * others)
    is_mirrored = np.linalg.det(affine) * np.linalg.det(other) < 0
    is_moved = np.linalg.norm(affine[:3, 3] - other[:3, 3]) > lengths.max()
    is_same_world = header["sform_code"] == header["qform_code"]
    if not (is_mirrored or (is_same_world and (is_moved or cosines.min() < _SAME_DIRECTION))):
        return ()
    what = "is the mirror image of" if is_mirrored else "lies elsewhere than"
    return (Notice("W-GEOMETRY-CONTRADICTED", f"the header's qform {what} its sform; the sform is taken"),)


def _doubtful_unit(affine: Float64Array, unit: int) -> tuple[Notice, ...]:
    """Return a warning where a unit that is told gives nodes so far apart, or so near, as none are."""
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    if unit not in UNITS or (lengths.min() >= _NEAREST_MM and lengths.max() <= _FARTHEST_MM):
        return ()
    told = " x ".join(f"{length:.4g}" for length in lengths)
    sentence = (
        f"the header's unit is the {UNIT_NAMES[unit]}, which puts nodes {told} mm apart; taken so; --spacing "
        "tells better"
    )
    return (Notice("W-UNIT-DOUBTFUL", sentence),)


def _is_flat(affine: Float64Array) -> bool:
    try:
        check_affine("", affine)
    except DamagedVolumeError:
        return True
    return False


def _contradiction(affine: Float64Array, header: Any) -> tuple[Notice, ...]:
    """Return a warning where pixdim has other distances of the nodes than the sform."""
    lengths, told = np.linalg.norm(affine[:3, :3], axis=0), np.abs(header["pixdim"][1:4].astype(np.float64))
    is_told = np.isfinite(told) & (told > 0)
    if not (np.abs(lengths - told) > _SAME_LENGTH * told)[is_told].any():
        return ()
    sform, pixdim = (" x ".join(f"{length:.6g}" for length in each) for each in (lengths, told))
    sentence = f"the header's sform has nodes {sform} apart, its pixdim {pixdim}; the sform is taken"
    return (Notice("W-GEOMETRY-CONTRADICTED", sentence),)


def _spacing(header: Any) -> tuple[float, float, float]:
    """Return the distances of the nodes along x, y, z; 1 where the header has none."""
    x, y, z = (abs(length) or 1.0 for length in header["pixdim"][1:4].tolist())
    return x, y, z


def _qform(header: Any, name: str) -> Float64Array:
    """Return the affine of the qform's quaternion, spacing, qfac and offset.

    Raises:
        DamagedVolumeError: The quaternion is longer than 1.
    """
    from nibabel.affines import from_matvec
    from nibabel.quaternions import quat2mat

    b, c, d = (float(header[f"quatern_{axis}"]) for axis in "bcd")
    rest = 1.0 - (b * b + c * c + d * d)
    if not rest > -_TOO_LONG:
        raise DamagedVolumeError(
            f"{name}: the header's qform has the quaternion {b:g}, {c:g}, {d:g}; expected a length of at "
            "most 1; the header is damaged"
        )
    a = math.sqrt(rest) if rest > _HALF_TURN[header.sizeof_hdr] else 0.0
    x, y, z = _spacing(header)
    turned = quat2mat((a, b, c, d)) * (x, y, -z if header["pixdim"][0] < 0 else z)
    return from_matvec(turned, [header[f"qoffset_{axis}"] for axis in "xyz"])  # type: ignore[no-any-return]
