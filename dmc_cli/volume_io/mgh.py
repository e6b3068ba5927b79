"""Read FreeSurfer's MGH: .mgh, gzipped .mgz and .mgh.gz; world axes RAS.

The header is nibabel's. Where it says that it tells no orientation, FreeSurfer and nibabel take a coronal
volume of 1 mm, centred; so do we, with a warning.
"""

from pathlib import Path

import numpy as np

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.axes import Axis, chosen_volume, flat_index, listed_volumes, stacked_image
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import Layout, check_file

HEADER_BYTES = 284

NO_ORIENTATION = (
    "the header tells no orientation (goodRASFlag is 0); taken as FreeSurfer does: coronal, 1 mm, centred"
)


def mgh_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of the chosen volume of an MGH file.

    Raises:
        UnsupportedFormatError: No MGH file, or values of a type that it cannot have.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    from nibabel.freesurfer.mghformat import MGHHeader

    check_file(path, name)
    start = first_bytes(path, name, HEADER_BYTES)
    if start[:4] != b"\0\0\0\1":
        raise UnsupportedFormatError(
            f"{name}: no MGH header found (it begins with the number 1, big endian); choose another reader "
            "with --input-format"
        )
    if len(start) < HEADER_BYTES:
        raise DamagedVolumeError(
            f"{name}: {len(start)} bytes found, {HEADER_BYTES} expected for the header alone; get the file "
            "again"
        )
    tells_orientation = any(start[28:30])
    header = MGHHeader(start, check=False)
    nx, ny, nz, volumes = header["dims"].tolist()
    if min(nx, ny, nz, volumes) < 1:
        raise DamagedVolumeError(
            f"{name}: axes of {nx} x {ny} x {nz} nodes and {volumes} volumes found; expected positive "
            "numbers; the header is damaged"
        )
    check_shape(name, (nx, ny, nz))
    image = stacked_image((nx, ny, nz), Axis("frame", volumes))
    choice = chosen_volume([image], settings, name)
    try:
        dtype = header.get_data_dtype()
    except KeyError as error:
        raise UnsupportedFormatError(
            f"{name}: values of type code {header['type']} found; expected 0, 1, 3, 4 or 10 (integers of 8, "
            "16 or 32 bits, float32); convert the volume to one of these"
        ) from error
    with np.errstate(all="ignore"):  # what is not finite is refused with the layout
        affine = header.get_affine()
    return Layout(
        name=name,
        shape=(nx, ny, nz),
        dtype=dtype,
        affine=affine,
        space="RAS",
        files=(path,),
        offset=HEADER_BYTES,
        volumes=volumes,
        volume=flat_index(image, choice),
        listed=listed_volumes([image], settings, name),
        format="mgh",
        warnings=() if tells_orientation else (Notice("W-ORIENTATION-MISSING", NO_ORIENTATION),),
    )
