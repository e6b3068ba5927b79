"""Read Zarr arrays and OME-Zarr images: a folder, unpacked by numcodecs, an extra; space none.

Of an OME-Zarr image the finest level is read, with the scale and the units of its metadata. Axes before
the last three count volumes.
"""

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError, DmcError, UnsupportedFormatError, VolumeError
from dmc_cli.notices import Notice
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry, allocate_values, check_shape, storable_type, widened_type
from dmc_cli.volume_io.layout import (
    ZARR_MARKERS,
    Triple,
    check_lengths,
    chosen_index,
    chosen_origin,
    chosen_spacing,
    scale_affine,
)
from dmc_cli.volume_io.lengths import Doubts, respaced
from dmc_cli.volume_io.units import scales_in_mm
from dmc_cli.volume_io.within import Bounds
from dmc_cli.volume_io.zarr.chunks import ChunkReader, chunk_files
from dmc_cli.volume_io.zarr.metadata import ZarrArray, read_node


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
    found = _opened(path, name, settings)
    array, shape = found.array, found.array.shape
    nodes = found.nodes(name)
    check_shape(name, nodes)
    dtype = storable_type(name, widened_type(array.packing.dtype))
    index = chosen_index(name, math.prod(shape[:-3]), settings.volume_index)
    files = chunk_files(found.folder, array, found.bounds, name)
    where = tuple(int(n) for n in np.unravel_index(index, shape[:-3]))
    values = allocate_values(name, nodes, dtype)
    ChunkReader(found.folder, array, where, values, name).read(files, settings.threads, progress)
    spacing, warnings = chosen_spacing(found.spacing, settings, "the store", found.doubts)
    origin, unused = chosen_origin(found.origin, settings, "the store")
    return Volume(
        values=values,
        affine=respaced(scale_affine(spacing, origin), found.doubts, settings),
        space="none",
        path=name,
        files=(path,),
        format="zarr",
        warnings=warnings + unused,
    )


def zarr_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the volume of the store as one entry, without its values.

    Raises:
        VolumeError: As `zarr_volume`.
    """
    return [VolumeEntry(description="zarr", size=_opened(path, name, settings).nodes(name))]


@dataclass(frozen=True)
class _Opened:
    """An array, its folder, where files may lie; spacing and origin in mm along x, y, z, None if not told.

    `doubts` are what is told of these lengths.
    """

    array: ZarrArray
    folder: Path
    bounds: Bounds
    spacing: Triple | None = None
    origin: Triple | None = None
    doubts: Doubts = ()

    def nodes(self, name: str) -> tuple[int, int, int]:
        """Return the nodes along x, y, z."""
        if len(self.array.shape) < 3:
            raise UnsupportedFormatError(
                f"{name}: an array of shape {self.array.shape} found; expected axes z, y, x"
            )
        nx, ny, nz = self.array.shape[:-4:-1]
        return nx, ny, nz


def _opened(path: Path, name: str, settings: ReadSettings) -> _Opened:
    """Return the array of a store: itself, or the finest level of its image."""
    bounds = Bounds(path, allow_outside=settings.allow_outside)
    try:
        node = read_node(path, bounds, name)
        if isinstance(node, ZarrArray):
            return _Opened(node, path, bounds)
        images = ((node or {}).get("ome") or node or {}).get("multiscales")
        if not images:
            inner = sorted(entry.name for entry in os.scandir(path) if entry.is_dir())
            raise UnsupportedFormatError(
                f"{name}: a Zarr group without an OME image found, with {', '.join(inner)[:200]}; "
                "give the path of one of its arrays"
            )
        level = images[0]["datasets"][0]
        spacing, origin, doubts = _placed(images[0], level, name)
        parts = [part for part in str(level["path"]).split("/") if part not in ("", ".")]
        if ".." in parts or any("\\" in part for part in parts):
            raise VolumeError(f"{name}: level {level['path']!r} leads out of the store; expected one in it")
        folder = path.joinpath(*parts)
        array = read_node(folder, bounds, name)
        if not isinstance(array, ZarrArray):
            raise DamagedVolumeError(
                f"{name}: level {level['path']!r} of the image is no array; get the data again"
            )
    except DmcError:
        raise
    except Exception as error:
        # what metadata that are not as specified run into: KeyError, TypeError, JSON's errors, ...
        told = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise DamagedVolumeError(f"{name}: the Zarr store cannot be read ({told}); get it again") from error
    check_lengths(name, spacing)
    return _Opened(array, folder, bounds, spacing, origin, doubts)


def _placed(image: Any, level: Any, name: str) -> tuple[Triple, Triple, Doubts]:
    """Return the spacing and origin of an OME level in millimetres, along x, y, z, and what is told of them.

    Raises:
        UnsupportedFormatError: An axis of space is measured in units of time.
    """
    steps = [*level.get("coordinateTransformations", []), *image.get("coordinateTransformations", [])]
    units = [axis.get("unit") for axis in image["axes"][:-4:-1]]
    scales, doubts = scales_in_mm([None if u is None else str(u) for u in units], name, "the store")
    if not any(step["type"] == "scale" for step in steps):
        sentence = "the store tells no scale; the distance of the nodes is taken as 1; --spacing gives it"
        doubts = (Notice("W-SPACING-MISSING", sentence), *doubts)
    steps.append({"type": "scale", "scale": scales[::-1]})
    spacing, origin = np.ones(3), np.zeros(3)
    with np.errstate(all="ignore"):  # what is not finite is refused with the lengths
        for step in steps:
            if step["type"] == "scale":
                scale = _last_three(step["scale"])
                spacing, origin = spacing * scale, origin * scale
            elif step["type"] == "translation":
                origin = origin + _last_three(step["translation"])
    (x, y, z), (p, q, r) = spacing.tolist(), origin.tolist()
    return (x, y, z), (p, q, r), doubts


def _last_three(numbers: Any) -> Float64Array:
    """Return the last three numbers of a list, x first; ValueError where there are fewer."""
    x, y, z = (float(number) for number in numbers[:-4:-1])
    return np.array([x, y, z])
