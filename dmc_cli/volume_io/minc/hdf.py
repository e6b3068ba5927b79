"""Open MINC 2, which is HDF5, by h5py, an extra, and nibabel.

How it is stored is looked at before any value is read (`hdf_storage.py`), and links are refused.
"""

from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.volume_io.hdf_heaps import check_heaps
from dmc_cli.volume_io.hdf_storage import Attributes, check_inside, check_stored, stored_slabs
from dmc_cli.volume_io.minc.image import MincImage
from dmc_cli.volume_io.minc.world import WHAT_PLACES

MISSING = 'h5py is not installed; pip install "dmc-cli[minc]" or pip install h5py'


def open_hdf(path: Path, name: str) -> MincImage:
    """Return the image of a file, which stays open as long as it is used.

    Raises:
        UnsupportedFormatError: h5py is missing, or the file leads elsewhere or is packed in an unusual way.
        DamagedVolumeError: The image is larger than what is stored of it.
        Exception: Whatever h5py and nibabel find wrong with it.
    """
    try:
        import h5py
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: a MINC 2 file found, but {MISSING}") from error
    from nibabel.minc2 import Minc2File

    check_heaps(path, name)
    file = h5py.File(path, "r")
    for group in ("/", "minc-2.0", "minc-2.0/image", "minc-2.0/image/0", "minc-2.0/dimensions"):
        _check_links(file[group], name, h5py)
    folder = file["minc-2.0/image/0"]
    image, ends = folder["image"], (folder["image-min"], folder["image-max"])
    for dataset in (image, *ends):
        check_inside(dataset, name)
    check_stored(image, path.stat().st_size, name, "convert it with mincconvert")
    minc = Minc2File(file)
    axes, ends_axes = _axes(image), _axes(ends[0])
    if ends_axes != _axes(ends[1]) or any(end.shape != image.shape[: end.ndim] for end in ends):
        raise ValueError("image-min and image-max along different axes")
    return MincImage(
        name=name,
        axes=axes,
        shape=image.shape,
        dtype=np.dtype(minc.get_data_dtype()),
        places=tuple(_places(file, axis) for axis in axes),
        valid=Attributes(image).get("valid_range"),
        ends=(np.asarray(ends[0]), np.asarray(ends[1])),
        ends_axes=ends_axes,
        slabs=lambda place: stored_slabs(image, (*place, None, None, None), name),
    )


def _check_links(group: Any, name: str, h5py: Any) -> None:
    """Refuse a group with a link to elsewhere, in this file or another one."""
    for key in group:
        if not isinstance(group.get(key, getlink=True), h5py.HardLink):
            raise UnsupportedFormatError(
                f"{name}: {group.name} holds a link, {key[:80]!r}; expected all values in this file; "
                "copy it with h5repack"
            )


def _places(file: Any, axis: str) -> dict[str, Any]:
    """Return what an axis tells of where its nodes lie."""
    attributes = Attributes(file[f"minc-2.0/dimensions/{axis}"])
    return {key: told for key in WHAT_PLACES if (told := attributes.get(key)) is not None}


def _axes(dataset: Any) -> tuple[str, ...]:
    """Return the names of a dataset's axes: as many as it has, whatever is written."""
    names = Attributes(dataset).get("dimorder", b"").decode("latin-1").split(",")
    return tuple(names[: dataset.ndim])
