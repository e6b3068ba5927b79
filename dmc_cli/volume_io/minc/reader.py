"""Read MINC 1 and 2: .mnc; world axes RAS. Headers and affines are nibabel's.

Axes before the last three count volumes. Slices that have scales of their own become physical values.
"""

import math
import warnings
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry, check_affine
from dmc_cli.volume_io.axes import Axis, Image, chosen_volume, listed_volumes, stacked_image
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import check_file, file_entry
from dmc_cli.volume_io.library_errors import library_errors
from dmc_cli.volume_io.minc.hdf import open_hdf
from dmc_cli.volume_io.minc.image import MincImage
from dmc_cli.volume_io.minc.netcdf import open_netcdf
from dmc_cli.volume_io.slices import stack_slices

NETCDF_MAGIC = b"CDF\x01", b"CDF\x02"
HDF_MAGIC = b"\x89HDF"


def minc_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the chosen volume of a MINC file.

    Raises:
        UnsupportedFormatError: No MINC file, or h5py is missing.
        DamagedVolumeError: The file cannot be understood, or promises more than it holds.
        AmbiguousVolumeError: Several volumes, and none chosen.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    with _told(name):
        image = _opened(path, name)
        shape = image.nodes()
        choice = chosen_volume([_stored(image)], settings, name)
        place = tuple(n for n in choice.where if n is not None)
        affine, told = image.world(settings)
        check_affine(name, affine)
        slabs = image.clipped(image.slabs(place))
        values, slope, intercept = stack_slices(
            name, shape, image.dtype, image.scales(place), slabs, progress
        )
    return Volume(
        values=values,
        affine=affine,
        space="RAS",
        slope=slope,
        intercept=intercept,
        path=name,
        files=(path,),
        format="minc",
        warnings=told,
    )


def minc_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the volumes of a file as one entry.

    Raises:
        VolumeError: As `minc_volume`.
    """
    with _told(name):
        image = _opened(path, name)
        image.nodes()
        listed = listed_volumes([_stored(image)], settings, name)
        return [file_entry("minc", math.prod(image.volumes), image.nodes(), listed)]


def _stored(image: MincImage) -> Image:
    """Return the axes, the last three in the order of the grid, whatever they are called."""
    others = [Axis(label, int(n)) for label, n in zip(image.axes, image.volumes, strict=False)]
    return stacked_image(image.nodes(), *others)


def _opened(path: Path, name: str) -> MincImage:
    """Return the image of a file of either version."""
    check_file(path, name)
    start = first_bytes(path, name, 4)
    if start not in (*NETCDF_MAGIC, HDF_MAGIC):
        raise UnsupportedFormatError(
            f"{name}: neither netCDF nor HDF5 found; expected a MINC file; choose another reader with "
            "--input-format"
        )
    # what is not finite is refused with the affine; spacing of a kind that nibabel warns of is regular
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return open_hdf(path, name) if start == HDF_MAGIC else open_netcdf(path, name)


def _told(name: str) -> AbstractContextManager[None]:
    """Tell in one message what nibabel and h5py run into, which may be any exception."""
    return library_errors(
        f"{name}: no MINC image that can be understood found",
        "expected one with regular axes, image-min and image-max; get the file again, or use mincconvert",
    )
