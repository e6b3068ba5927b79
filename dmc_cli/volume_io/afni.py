"""Read AFNI's pairs of .HEAD and .BRIK, packed or not; world axes RAS.

The header is nibabel's. Each sub-brick is a volume with a factor of its own.
"""

from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.axes import Axis, chosen_volume, flat_index, listed_volumes, stacked_image
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import Layout, check_file
from dmc_cli.volume_io.pair import checked_pair

LARGEST_HEADER = 1 << 26
"""More than any history of processing that an AFNI header holds."""

SAME_LENGTH = 1e-3
"""Part of a distance by which two statements of it may differ: writers round to a few digits."""


def afni_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of the chosen sub-brick of a pair.

    Raises:
        VolumeError: One of the two files is not there.
        DamagedVolumeError: The header cannot be understood.
        AmbiguousVolumeError: Several sub-bricks, and none chosen.
    """
    header_path, data_path = checked_pair(path, name, settings.allow_outside)
    header = _header(header_path, name)
    nx, ny, nz, volumes = (int(n) for n in header.get_data_shape())
    check_shape(name, (nx, ny, nz))
    image = stacked_image((nx, ny, nz), _sub_bricks(header.info, volumes))
    volume = flat_index(image, chosen_volume([image], settings, name, "sub-bricks"))
    factors = np.atleast_1d(header.info.get("BRICK_FLOAT_FACS", 0.0))
    factor = float(factors[volume]) if volume < len(factors) else 0.0
    return Layout(
        name=name,
        shape=(nx, ny, nz),
        dtype=header.get_data_dtype(),
        affine=header.get_affine(),
        space="RAS",
        files=(data_path,),
        headers=(header_path,),
        volumes=volumes,
        volume=volume,
        listed=listed_volumes([image], settings, name),
        slope=factor or 1.0,  # 0 means that there is none
        format="afni",
        warnings=_contradiction(header),
    )


def _contradiction(header: Any) -> tuple[Notice, ...]:
    """Return a warning where DELTA has other distances, in mm, than the matrix, which is taken."""
    told = np.abs(np.atleast_1d(header.info["DELTA"])[:3]).astype(float)
    with np.errstate(all="ignore"):  # what is not finite is refused with the layout
        lengths = np.linalg.norm(header.get_affine()[:3, :3], axis=0)
        if len(told) == 3 and not (np.abs(told - lengths) > SAME_LENGTH * lengths).any():
            return ()
    first, second = (" x ".join(f"{each:.6g}" for each in each_of) for each_of in (told, lengths))
    sentence = (
        f"the header's DELTA is {first} mm, IJK_TO_DICOM_REAL has nodes {second} mm apart; this is taken"
    )
    return (Notice("W-GEOMETRY-CONTRADICTED", sentence),)


def _sub_bricks(info: Any, count: int) -> Axis:
    """Return the axis of sub-bricks: of time where the header says how times follow, with their labels."""
    labels = str(info.get("BRICK_LABS", "")).split("~")
    is_time = int(np.atleast_1d(info.get("TAXIS_NUMS", 0))[0]) > 1
    return Axis("time" if is_time else "sub-brick", count, tuple(label[:100] for label in labels[:count]))


def _header(path: Path, name: str) -> Any:
    """Return the header of nibabel's class, with four sizes and an affine.

    Raises:
        DamagedVolumeError: It cannot be understood.
    """
    from nibabel.brikhead import AFNIHeader

    size = check_file(path, name)
    if size > LARGEST_HEADER:
        raise DamagedVolumeError(
            f"{name}: {size} bytes of {path.name} found; expected a header of at most {LARGEST_HEADER}"
        )
    text = first_bytes(path, name, LARGEST_HEADER).decode("latin-1")
    try:
        header = AFNIHeader.from_fileobj(StringIO(text, newline=None))
        found = header.get_data_shape()
        if len(found) != 4 or not all(isinstance(n, int) and n > 0 for n in found):
            raise ValueError(f"sizes {found}")
        with np.errstate(all="ignore"):
            header.get_affine()
    except Exception as error:
        # nibabel raises whatever its parsing runs into: an attribute that is missing is a KeyError
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(
            f"{name}: {path.name} is no AFNI header that can be understood ({type(error).__name__}: "
            f"{told}); "
            "expected sizes, type, byte order and IJK_TO_DICOM_REAL; write it anew with 3dcopy"
        ) from error
    return header
