"""Zarr arrays and OME-Zarr images: a folder, read through zarr, an extra; space none.

Of an OME-Zarr image the finest level is read, with the scale and the units of its metadata. Axes before
the last three count volumes.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError, DmcError, UnsupportedFormatError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume.allocation import allocate_values
from dmc_cli.volume.layout import (
    MILLIMETRES,
    ZARR_MARKERS,
    Triple,
    check_shape,
    chosen_index,
    chosen_origin,
    chosen_spacing,
    scale_affine,
    storable_type,
)
from dmc_cli.volume.volume import Volume, VolumeEntry
from dmc_cli.volume.zarr_chunks import check_chunks

MISSING = 'zarr is not installed; pip install "dmc-cli[zarr]" or pip install zarr'


def is_zarr(path: Path) -> bool:
    """Whether a folder is a Zarr array or group."""
    return any((path / marker).is_file() for marker in ZARR_MARKERS)


def zarr_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """The volume of an array, or of the finest level of an OME-Zarr image.

    Raises:
        UnsupportedFormatError: zarr is missing, or there is no numeric array with three axes.
        DamagedVolumeError: The store cannot be read.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    array, folder, told_spacing, told_origin = _opened(path, name)
    shape = tuple(int(n) for n in array.shape)
    if len(shape) < 3:
        raise UnsupportedFormatError(f"{name}: an array of shape {shape} found; expected axes z, y, x")
    nodes = shape[:-4:-1]
    check_shape(name, nodes)
    dtype = storable_type(name, np.dtype(array.dtype))
    index = chosen_index(name, math.prod(shape[:-3]), settings.volume_index)
    where = np.unravel_index(index, shape[:-3]) if shape[:-3] else ()
    depth = array.chunks[-3]
    try:
        check_chunks(folder, shape, dtype.itemsize, name)
        values = allocate_values(name, (nodes[0], nodes[1], nodes[2]), dtype)
        for k in range(0, nodes[2], depth):
            values[k : k + depth] = array[(*(int(n) for n in where), slice(k, k + depth))]
            progress.advance(min(1.0, (k + depth) / nodes[2]))
    except DmcError:
        raise
    except Exception as error:
        # codecs raise what they like
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(f"{name}: a chunk cannot be read ({told}); get the data again") from error
    spacing, warnings = chosen_spacing(told_spacing, settings, "the store")
    origin, unused = chosen_origin(told_origin, settings, "the store")
    return Volume(
        values=values,
        affine=scale_affine(spacing, origin),
        space="none",
        path=name,
        files=(path,),
        format="zarr",
        warnings=warnings + unused,
    )


def zarr_entries(path: Path, name: str) -> list[VolumeEntry]:
    """The volume of the store as one entry, without its values.

    Raises:
        VolumeError: As `zarr_volume`.
    """
    array, *_ = _opened(path, name)
    if len(array.shape) < 3:
        raise UnsupportedFormatError(f"{name}: an array of shape {array.shape} found; expected axes z, y, x")
    nx, ny, nz = (int(n) for n in array.shape[:-4:-1])
    return [VolumeEntry(description="zarr", size=(nx, ny, nz))]


def _opened(path: Path, name: str) -> tuple[Any, Path, Triple | None, Triple | None]:
    """The array, its folder, spacing and origin along x, y, z in mm, None where the store tells none."""
    try:
        import zarr
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: a Zarr store found, but {MISSING}") from error
    try:
        node: Any = zarr.open(str(path), mode="r")
        if hasattr(node, "shape"):
            return node, path, None, None
        attributes = dict(node.attrs)
        images = attributes.get("ome", attributes).get("multiscales")
        if not images:
            raise UnsupportedFormatError(
                f"{name}: a Zarr group without an OME image found, with {', '.join(sorted(node))[:200]}; "
                "give the path of one of its arrays"
            )
        level = images[0]["datasets"][0]
        spacing, origin = _placed(images[0], level)
        array = node[level["path"]]
        if not hasattr(array, "shape"):
            raise DamagedVolumeError(
                f"{name}: level {level['path']!r} of the image is no array; get the data again"
            )
        return array, path / str(level["path"]), spacing, origin
    except DmcError:
        raise
    except Exception as error:
        # zarr raises KeyError, ValueError, JSON's errors and its own
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(f"{name}: the Zarr store cannot be read ({told}); get it again") from error


def _placed(image: Any, level: Any) -> tuple[Triple, Triple]:
    """Spacing and origin of an OME level in millimetres, along x, y, z."""
    units = [MILLIMETRES.get(axis.get("unit", "mm"), 1.0) for axis in image["axes"]][:-4:-1]
    spacing, origin = [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]
    for step in [*level.get("coordinateTransformations", []), *image.get("coordinateTransformations", [])]:
        if step["type"] == "scale":
            scale = [float(s) for s in step["scale"][:-4:-1]]
            spacing = [a * b for a, b in zip(spacing, scale, strict=True)]
            origin = [a * b for a, b in zip(origin, scale, strict=True)]
        elif step["type"] == "translation":
            origin = [a + float(b) for a, b in zip(origin, step["translation"][:-4:-1], strict=True)]
    x, y, z = (a * u for a, u in zip(spacing, units, strict=True))
    p, q, r = (a * u for a, u in zip(origin, units, strict=True))
    return (x, y, z), (p, q, r)
