"""NIfTI-1 and NIfTI-2: .nii, .nii.gz and pairs of .hdr and .img (gzipped too); world axes RAS.

nibabel reads the header; the values are loaded as they lie. The affine is the sform's, else the
qform's. With both codes 0 the header tells no orientation: then x = pixdim * index with origin 0 and
no space (nibabel's own fallback would centre and flip the volume), with a warning.
"""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume.layout import (
    Encoding,
    Layout,
    check_file,
    check_shape,
    chosen_index,
    scale_affine,
    storable_type,
)
from dmc_cli.volume.pair import is_gzip, pair_files, read_start
from dmc_cli.volume.volume import Space

_Affine = np.ndarray[Any, np.dtype[np.float64]]

UNITS = {0: 1.0, 1: 1e3, 2: 1.0, 3: 1e-3}
"""Lower three bits of xyzt_units to millimetres: unknown, metre, millimetre, micrometre."""

NO_ORIENTATION = (
    "the header tells no orientation (sform and qform codes are 0); axes and origin are the grid's own"
)

HEADER_BYTES = {348: b"n+1 ni1", 540: b"n+2 ni2"}


def nifti_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """The layout of the volume `settings.volume_index` of a NIfTI file or pair.

    Raises:
        UnsupportedFormatError: No NIfTI file, or values that are not single real numbers.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    header_path, data_path = pair_files(path)
    check_file(header_path, name)
    header = _parse(read_start(header_path, name), name)
    shape, volumes = _grid(header, name)
    dtype = storable_type(name, _value_type(header, name))
    affine, space, notes = _affine(header, name)
    slope, intercept = _scaling(header)
    single = bytes(header["magic"])[:2] == b"n+"
    offset = _offset(header, name, single)
    encoding: Encoding = "gzip" if is_gzip(data_path if not single else header_path, name) else "raw"
    return Layout(
        name=name,
        shape=shape,
        dtype=dtype,
        affine=affine,
        space=space,
        files=(header_path if single else data_path,),
        offset=offset,
        encoding=encoding,
        volumes=volumes,
        volume=chosen_index(name, volumes, settings.volume_index),
        slope=slope,
        intercept=intercept,
        format="nifti",
        warnings=notes,
    )


def _parse(start: bytes, name: str) -> Any:
    """The header as nibabel's object, of either version and byte order."""
    import nibabel

    size = next(
        (n for n in HEADER_BYTES for order in ("little", "big") if int.from_bytes(start[:4], order) == n),
        None,  # type: ignore[arg-type]
    )
    magic = start[344:347] if size == 348 else start[4:7]
    if size is None or len(magic) < 3 or magic not in HEADER_BYTES[size].split():
        raise UnsupportedFormatError(
            f"{name}: no NIfTI header found (its first number is neither 348 nor 540, or the magic bytes are "
            "missing); "
            "expected NIfTI-1 or NIfTI-2; choose another reader with --input-format"
        )
    if len(start) < size:
        raise DamagedVolumeError(
            f"{name}: {len(start)} bytes found, {size} expected for the header alone; get the file again"
        )
    kind = nibabel.Nifti1Header if size == 348 else nibabel.Nifti2Header
    try:
        return kind(start[:size], check=False)
    except Exception as error:
        raise DamagedVolumeError(
            f"{name}: the header cannot be read ({error}); get the file again"
        ) from error


def _grid(header: Any, name: str) -> tuple[tuple[int, int, int], int]:
    """Nodes along x, y, z and the number of volumes."""
    dim = [int(n) for n in header["dim"]]
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


def _value_type(header: Any, name: str) -> np.dtype[Any]:
    try:
        dtype: np.dtype[Any] = header.get_data_dtype()
    except Exception as error:
        raise UnsupportedFormatError(
            f"{name}: datatype code {int(header['datatype'])} found; expected a real number's"
        ) from error
    return dtype


def _offset(header: Any, name: str, single: bool) -> int:
    offset = float(header["vox_offset"])
    if not math.isfinite(offset) or offset < 0 or offset > 2**40:
        raise DamagedVolumeError(
            f"{name}: vox_offset is {offset:g}; expected a position in the file; the header is damaged"
        )
    least = int(header["sizeof_hdr"]) + 4 if single else 0
    return max(int(offset), least)


def _scaling(header: Any) -> tuple[float, float]:
    """Slope and intercept; slope 0 or not finite means that there is none."""
    slope, intercept = float(header["scl_slope"]), float(header["scl_inter"])
    if slope == 0 or not math.isfinite(slope):
        return 1.0, 0.0
    return slope, intercept if math.isfinite(intercept) else 0.0


def _affine(header: Any, name: str) -> tuple[_Affine, Space, tuple[str, ...]]:
    """Affine in millimetres, its space, and warnings."""
    unit = int(header["xyzt_units"]) & 7
    scale = UNITS.get(unit, 1.0)
    notes: tuple[str, ...] = ()
    if unit not in UNITS:
        notes = (f"the header's unit of length has the unknown code {unit}; taken as millimetres",)
    spacing = [abs(float(s)) for s in header["pixdim"][1:4]]
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if int(header["sform_code"]) > 0:
                affine, space = np.asarray(header.get_sform(), np.float64), "RAS"
            elif int(header["qform_code"]) > 0:
                affine, space = np.asarray(header.get_qform(), np.float64), "RAS"
            else:
                affine, space = scale_affine((spacing[0], spacing[1], spacing[2]), (0.0, 0.0, 0.0)), "none"
                notes += (NO_ORIENTATION,)
        except Exception as error:
            raise DamagedVolumeError(
                f"{name}: the header's orientation cannot be read ({error}); get the file again"
            ) from error
    affine = affine.copy()
    with np.errstate(all="ignore"):
        affine[:3] *= scale
    return affine, "RAS" if space == "RAS" else "none", notes
