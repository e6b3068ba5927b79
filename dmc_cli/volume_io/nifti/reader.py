"""Read NIfTI-1 and NIfTI-2: .nii, .nii.gz and pairs of .hdr and .img (gzipped too); world axes RAS.

The affine is the sform's, else the qform's. With both codes 0 the header tells no orientation: then
x = pixdim * index with origin 0 and no space (nibabel would centre and flip the volume), with a warning.
"""

import math
from pathlib import Path

import numpy as np

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume.checks import check_shape
from dmc_cli.volume.volume import Space
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import Encoding, Layout, chosen_index, scale_affine
from dmc_cli.volume_io.nifti.header import RECORDS, Matrix, NiftiHeader, parse_nifti
from dmc_cli.volume_io.pair import checked_pair, is_gzip

UNITS = {0: 1.0, 1: 1e3, 2: 1.0, 3: 1e-3}
"""Lower three bits of xyzt_units to millimetres: unknown, metre, millimetre, micrometre."""

NO_ORIENTATION = (
    "the header tells no orientation (sform and qform codes are 0); axes and origin are the grid's own"
)


def nifti_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of the volume `settings.volume_index` of a NIfTI file or pair.

    Raises:
        UnsupportedFormatError: No NIfTI file, or values that are not single real numbers.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    header_path, data_path = checked_pair(path, name, settings.allow_outside)
    header = parse_nifti(first_bytes(header_path, name, max(RECORDS)), name)
    shape, volumes = _grid(header, name)
    affine, space, notes = _affine(header, name)
    slope, intercept = _scaling(header)
    values_path = header_path if header.single else data_path
    encoding: Encoding = "gzip" if is_gzip(values_path, name) else "raw"
    return Layout(
        name=name,
        shape=shape,
        dtype=header.value_type(name),
        affine=affine,
        space=space,
        files=(values_path,),
        offset=_offset(header, name),
        encoding=encoding,
        volumes=volumes,
        volume=chosen_index(name, volumes, settings.volume_index),
        slope=slope,
        intercept=intercept,
        format="nifti",
        warnings=notes,
    )


def _grid(header: NiftiHeader, name: str) -> tuple[tuple[int, int, int], int]:
    """Return the numbers of nodes along x, y, z, and of volumes."""
    dim = [int(n) for n in header.fields["dim"]]
    if not 1 <= dim[0] <= 7:
        raise DamagedVolumeError(
            f"{name}: {dim[0]} axes found in the header; expected 1 to 7; the header is damaged"
        )
    sizes = dim[1 : dim[0] + 1]
    sizes += [1] * (3 - len(sizes))
    if any(n < 1 for n in sizes):
        raise DamagedVolumeError(
            f"{name}: axes of {sizes} nodes found; expected positive numbers; the header is damaged"
        )
    shape = sizes[0], sizes[1], sizes[2]
    check_shape(name, shape)
    return shape, math.prod(sizes[3:])


def _offset(header: NiftiHeader, name: str) -> int:
    """Return where the values begin in their file."""
    offset = float(header.fields["vox_offset"])
    if not math.isfinite(offset) or offset < 0 or offset > 2**40:
        raise DamagedVolumeError(
            f"{name}: vox_offset is {offset:g}; expected a position in the file; the header is damaged"
        )
    return max(int(offset), header.size + 4 if header.single else 0)


def _scaling(header: NiftiHeader) -> tuple[float, float]:
    """Return slope and intercept; a slope that is 0 or not finite means that there is none."""
    slope, intercept = float(header.fields["scl_slope"]), float(header.fields["scl_inter"])
    if slope == 0 or not math.isfinite(slope):
        return 1.0, 0.0
    return slope, intercept if math.isfinite(intercept) else 0.0


def _affine(header: NiftiHeader, name: str) -> tuple[Matrix, Space, tuple[str, ...]]:
    """Return the affine in millimetres, its space, and warnings."""
    unit = int(header.fields["xyzt_units"]) & 7
    notes: tuple[str, ...] = ()
    if unit not in UNITS:
        notes = (f"the header's unit of length has the unknown code {unit}; taken as millimetres",)
    space: Space = "RAS"
    with np.errstate(all="ignore"):  # what is not finite is refused with the layout
        if header.fields["sform_code"] > 0:
            affine = header.sform()
        elif header.fields["qform_code"] > 0:
            affine = header.qform(name)
        else:
            affine, space = scale_affine(header.spacing(), (0.0, 0.0, 0.0)), "none"
            notes += (NO_ORIENTATION,)
        affine[:3] *= UNITS.get(unit, 1.0)
    return affine, space, notes
