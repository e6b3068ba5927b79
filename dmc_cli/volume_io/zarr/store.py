"""Read Zarr arrays and OME-Zarr images: a folder, unpacked by numcodecs, an extra; space none.

Of an OME-Zarr image the finest level is read, with the scale and the units of its metadata. Its axes are
taken by their names and types; where an array names none, those before the last three count volumes.
"""

from pathlib import Path

import numpy as np

from dmc_cli.errors import DamagedVolumeError, DmcError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry, allocate_values, check_shape, storable_type, widened_type
from dmc_cli.volume_io.axes import chosen_volume, images_entry, unnamed_axes
from dmc_cli.volume_io.climate import true_type, without_missing
from dmc_cli.volume_io.layout import (
    ZARR_MARKERS,
    chosen_origin,
    chosen_spacing,
    scale_affine,
)
from dmc_cli.volume_io.lengths import respaced, unsettled_lengths
from dmc_cli.volume_io.within import Bounds
from dmc_cli.volume_io.zarr.chunks import ChunkReader, chunk_files
from dmc_cli.volume_io.zarr.images import stored_images
from dmc_cli.volume_io.zarr.stored import StoredImage


def is_zarr(path: Path) -> bool:
    """Return whether a folder is a Zarr array or group."""
    return any((path / marker).is_file() for marker in ZARR_MARKERS)


def zarr_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume of an array, or of the finest level of an OME-Zarr image.

    Raises:
        UnsupportedFormatError: A package is missing, or there is no numeric array with three axes.
        DamagedVolumeError: The store cannot be read.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    images, bounds = _opened(path, name, settings)
    choice = chosen_volume([stored.image for stored in images], settings, name)
    found = images[choice.image]
    array, grid = found.array, found.image.grid
    assert grid is not None
    check_shape(name, found.image.nodes)
    dtype = storable_type(name, widened_type(true_type(array.attributes, array.packing.dtype)))
    told_spacing, told_origin, doubts = found.placed(name)
    files = chunk_files(found.folder, array, bounds, name)
    values = allocate_values(name, found.image.nodes, dtype)
    stored = values.transpose(np.argsort(grid))  # its axes in the order of the array's
    ChunkReader(found.folder, array, choice.where, stored, name).read(files, settings.threads, progress)
    padding, marked = without_missing(array.attributes, values, array.scale)
    spacing, warnings = chosen_spacing(told_spacing, settings, "the store", doubts)
    origin, unused = chosen_origin(told_origin, settings, "the store")
    unsettled = unsettled_lengths(found.plain[2], settings)
    return Volume(
        values=values,
        affine=respaced(scale_affine(spacing, origin), doubts, settings),
        space="none",
        path=name,
        files=(path,),
        format="zarr",
        slope=array.scale[0],
        intercept=array.scale[1],
        padding=padding,
        warnings=(*unnamed_axes(found.image), *unsettled, *array.notices, *marked, *warnings, *unused),
    )


def zarr_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the store as one entry with the volumes that it holds, without their values.

    Raises:
        VolumeError: As `zarr_volume`.
    """
    images, _ = _opened(path, name, settings)
    return [images_entry("zarr", [stored.image for stored in images], settings, name)]


def _opened(path: Path, name: str, settings: ReadSettings) -> tuple[list[StoredImage], Bounds]:
    """Return the images of a store, and where its files may lie."""
    bounds = Bounds(path, allow_outside=settings.allow_outside)
    try:
        return stored_images(path, bounds, name), bounds
    except DmcError:
        raise
    except Exception as error:
        # what metadata that are not as specified run into: KeyError, TypeError, JSON's errors, ...
        told = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise DamagedVolumeError(f"{name}: the Zarr store cannot be read ({told}); get it again") from error
