"""Read a dataset of an HDF5 file: `file.h5`, or `file.h5:/entry/data` where it holds several.

Read through h5py, an extra. Axes are taken by their names; of those without one the last three are z, y, x,
and the others count volumes.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import (
    Volume,
    VolumeEntry,
    allocate_values,
    check_affine,
    check_shape,
    storable_type,
    widened_type,
)
from dmc_cli.volume_io.axes import Image, chosen_volume, listed_volumes
from dmc_cli.volume_io.climate import scale_of_values, true_type, without_missing
from dmc_cli.volume_io.content import START, first_bytes
from dmc_cli.volume_io.hdf5.images import hdf_images
from dmc_cli.volume_io.hdf5.spim_data import SpimData, is_spim_data, spim_data_beside, spim_data_of
from dmc_cli.volume_io.hdf5.stored import Stored, Where
from dmc_cli.volume_io.hdf_heaps import check_heaps
from dmc_cli.volume_io.hdf_path import split_dataset
from dmc_cli.volume_io.hdf_storage import (
    DEFLATE,
    FLETCHER,
    LZF,
    SHUFFLE,
    Attributes,
    check_inside,
    check_stored,
    stored_slabs,
)
from dmc_cli.volume_io.layout import check_file, chosen_origin, chosen_spacing, file_entry
from dmc_cli.volume_io.lengths import respaced, unsettled_lengths
from dmc_cli.volume_io.library_errors import library_errors

MISSING = 'h5py is not installed; pip install "dmc-cli[hdf5]" or pip install h5py'

MINC_GROUP = "minc-2.0"


def hdf5_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume of a dataset.

    Raises:
        UnsupportedFormatError: No dataset with a volume, an unusual packing, or h5py is missing.
        DamagedVolumeError: The file cannot be understood, or promises more than it holds.
        AmbiguousVolumeError: Several datasets or volumes, and none chosen.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    with _opened(path, name, settings) as (images, files):
        choice = chosen_volume([stored.image for stored in images], settings, name)
        image = images[choice.image].image
        check_shape(name, image.nodes)
        dataset, where, geometry = images[choice.image].find(choice.where)
        check_inside(dataset, name)
        filters = (DEFLATE, SHUFFLE, FLETCHER, LZF)
        check_stored(dataset, files[0].stat().st_size, name, "copy it with h5repack -f GZIP=4", filters)
        spacing, notices = chosen_spacing(geometry.spacing, settings, doubts=geometry.doubts)
        unsettled = unsettled_lengths(geometry.unsettled, settings)
        origin, unused = chosen_origin(geometry.origin, settings)
        affine = np.eye(4)
        directions = np.eye(3) if geometry.directions is None else geometry.directions
        affine[:3, :3] = directions * np.array(spacing)
        affine[:3, 3] = origin
        affine = respaced(affine, geometry.doubts, settings)
        check_affine(name, affine)
        attributes = Attributes(dataset)
        stored_as = geometry.dtype or true_type(attributes, dataset.dtype)
        values = _values(dataset, image, where, stored_as, name, progress)
        slope, intercept, told = geometry.scale or scale_of_values(attributes)
        padding, marked = without_missing(attributes, values, (slope, intercept))
    return Volume(
        values=values,
        affine=affine,
        space=geometry.space,
        path=name,
        files=files,
        format="hdf5",
        slope=slope,
        intercept=intercept,
        padding=padding,
        warnings=(*geometry.notices, *unsettled, *told, *marked, *notices, *unused),
    )


def hdf5_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the volumes of a dataset as one entry.

    Raises:
        VolumeError: As `hdf5_volume`.
    """
    with _opened(path, name, settings) as (stored, _):
        images = [each.image for each in stored]
        listed = listed_volumes(images, settings, name)
        counts = [math.prod(axis.size for axis in image.axes) // math.prod(image.nodes) for image in images]
        return [file_entry("hdf5", sum(counts), images[0].nodes, listed)]


@contextmanager
def _opened(path: Path, name: str, settings: ReadSettings) -> Iterator[tuple[list[Stored], tuple[Path, ...]]]:
    """Open a file for its images and give these and the files; tell in one message whatever h5py meets."""
    source, named = split_dataset(path)
    check_file(source, name)
    try:
        import h5py
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: an HDF5 file found, but {MISSING}") from error
    with library_errors(f"{name}: the HDF5 file cannot be read"):
        spim: SpimData | None
        if is_spim_data(first_bytes(source, name, START)):
            spim, source = spim_data_of(source, name, settings.allow_outside)
            check_file(source, name)
        else:
            spim = spim_data_beside(source)
        files = (source,) if spim is None else (source, spim.path)
        check_heaps(source, name)
        with h5py.File(source, "r") as file:
            if not named and MINC_GROUP in file:
                raise UnsupportedFormatError(f"{name}: a MINC 2 file found; read it with --input-format minc")
            yield hdf_images(file, named, spim, name, h5py), files


def _values(
    dataset: Any, image: Image, where: Where, dtype: np.dtype[Any], name: str, progress: Progress
) -> AnyArray:
    """Return the values of a volume, shape (nz, ny, nx), read a few planes at a time; no padding.

    `dtype` is the type that they have in truth, of as many bytes as the dataset's.
    """
    assert image.grid is not None
    values = allocate_values(name, image.nodes, storable_type(name, widened_type(dtype)))
    target = values.transpose(tuple(int(axis) for axis in np.argsort(image.grid)))
    done = 0
    for slab in stored_slabs(dataset, where, name):
        count = min(len(slab), len(target) - done)
        part = slab[:count, : target.shape[1], : target.shape[2]]
        target[done : done + count] = part if dtype == dataset.dtype else part.astype(dtype)
        done += count
        progress.advance(done / len(target))
    return values
