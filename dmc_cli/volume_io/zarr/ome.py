"""Find the images of an OME-Zarr group of version 0.1 to 0.5: of each the finest level.

Axes of version 0.4 and 0.5 have names and types, those of 0.3 names; before they were t, c, z, y, x. Versions
before 0.4 tell no distances.
"""

from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.volume_io.axes import UNNAMED, Axis, Image
from dmc_cli.volume_io.within import Bounds
from dmc_cli.volume_io.zarr.chunks import stored_line
from dmc_cli.volume_io.zarr.metadata import MAX_AXES, ZarrArray, read_node
from dmc_cli.volume_io.zarr.stored import StoredImage

OLD_AXES = "tczyx"
"""The axes of OME-Zarr 0.1 and 0.2, of which the first ones may be missing."""

MOST_IMAGES = 10_000
"""More images than a store has."""


def within_store(path: Path, told: str, name: str) -> Path:
    """Return a folder of a store by the path that its metadata have for it."""
    parts = [part for part in told.split("/") if part not in ("", ".")]
    if ".." in parts or any("\\" in part for part in parts):
        raise VolumeError(f"{name}: {told!r:.80} leads out of the store; expected a folder in it")
    return path.joinpath(*parts)


def ome_images(
    path: Path, attributes: dict[str, Any], bounds: Bounds, name: str, title: str = "", wanted: str = ""
) -> list[StoredImage]:
    """Return the finest level of each image of a group, or only the level with the path that is wanted."""
    channels = (attributes.get("omero") or {}).get("channels") or ()
    labels = tuple(str(channel.get("label", "")) for channel in channels)
    found = []
    for number, image in enumerate(attributes["multiscales"][:MOST_IMAGES]):
        levels = [level for level in image["datasets"] if wanted in ("", level["path"])]
        if wanted and not levels:
            continue
        if "coordinateSystems" in image:
            raise UnsupportedFormatError(
                f"{name}: an OME image with coordinate systems found; expected OME-Zarr 0.1 to 0.5; "
                "convert it"
            )
        level = _finest(levels)
        folder = within_store(path, str(level["path"]), name)
        array = read_node(folder, bounds, name)
        if not isinstance(array, ZarrArray):
            raise DamagedVolumeError(
                f"{name}: level {level['path']!r} of the image is no array; get the data again"
            )
        axes = _ome_axes(image, array.shape, labels)
        scale, shift = _placed(image, level, path, bounds, name)
        titled = str(image.get("name") or title or f"image {number}")
        units = tuple(_unit(axis) for axis in image.get("axes", ()))
        found.append(StoredImage(folder, array, Image(axes, titled), scale, shift, units))
    return found


def _finest(levels: list[Any]) -> Any:
    """Return the level whose nodes lie nearest to one another; the first where not all tell it in numbers.

    The specification has the finest level first; some writers have it last.
    """
    steps = [[step.get("scale") for step in level.get("coordinateTransformations", [])] for level in levels]
    cells = []
    for scales in steps:
        told = [_numbers(scale, len(scale)) for scale in scales if isinstance(scale, list)]
        cells.append(float(np.prod(told)) if told else 0.0)
    if not all(np.isfinite(cell) and cell > 0 for cell in cells):
        return levels[0]
    return levels[int(np.argmin(cells))]


def ome_attributes(node: Any) -> dict[str, Any]:
    """Return the attributes of a group in which OME-Zarr keeps its own: since version 0.5 in `ome`."""
    attributes = node if isinstance(node, dict) else {}
    return attributes.get("ome") or attributes


def _ome_axes(image: Any, shape: tuple[int, ...], channels: tuple[str, ...]) -> tuple[Axis, ...]:
    """Return the axes of an OME image, with the names of its channels.

    Axes of space are to be x, y and z; of those with other names the last one is x, as the specification has
    it. An axis without a type is what its name says.
    """
    if "axes" not in image:
        if len(shape) > len(OLD_AXES):
            raise ValueError(f"{len(shape)} axes; expected t, c, z, y, x")
        return tuple(
            Axis(name, size, channels if name == "c" else ())
            for name, size in zip(OLD_AXES[-len(shape) :], shape, strict=True)
        )
    if len(image["axes"]) != len(shape):
        raise ValueError(f"{len(image['axes'])} axes told for an array of {len(shape)}")
    axes = []
    for told, size in zip(image["axes"], shape, strict=True):
        named, kind = (told, None) if isinstance(told, str) else (str(told["name"]), told.get("type"))
        if kind == "space" and Axis(named, size).kind not in ("x", "y", "z"):
            named = UNNAMED
        elif kind in ("time", "channel"):
            named = kind
        axis = Axis(named, size)
        axes.append(Axis(named, size, channels) if axis.kind == "channel" else axis)
    return tuple(axes)


def _unit(axis: Any) -> str | None:
    found = None if isinstance(axis, str) else axis.get("unit")
    return None if found is None else str(found)


def _placed(
    image: Any, level: Any, path: Path, bounds: Bounds, name: str
) -> tuple[Float64Array | None, Float64Array | None]:
    """Return distance and place along each axis, in its unit; None where no scale, or no place, is told."""
    steps = [*level.get("coordinateTransformations", []), *image.get("coordinateTransformations", [])]
    steps = [step for step in steps if step["type"] != "identity"]
    strange = [step["type"] for step in steps if step["type"] not in ("scale", "translation")]
    if strange:
        raise UnsupportedFormatError(
            f"{name}: an OME image with a transformation {strange[0]!r:.40} found; expected scale and "
            "translation; resample the image along its axes"
        )
    if not steps:
        return None, None
    dimension = len(image["axes"])
    scale, shift = np.ones(dimension), np.zeros(dimension)
    with np.errstate(all="ignore"):  # what is not finite is refused with the lengths
        for step in steps:
            kind = step["type"]
            told = step[kind] if kind in step else _stored_numbers(path, step["path"], bounds, name)
            factors = _numbers(told, dimension)
            if kind == "scale":
                scale, shift = scale * factors, shift * factors
            else:
                shift = shift + factors
    return (scale if any(step["type"] == "scale" for step in steps) else None), shift


def _stored_numbers(path: Path, told: Any, bounds: Bounds, name: str) -> AnyArray:
    """Return the numbers of a transformation that lie in an array of the store."""
    folder = within_store(path, str(told), name)
    array = read_node(folder, bounds, name)
    if not isinstance(array, ZarrArray) or len(array.shape) != 1 or array.shape[0] > MAX_AXES:
        raise DamagedVolumeError(
            f"{name}: a transformation in {str(told)!r:.80} found, which is no array of one axis; get the "
            "data again"
        )
    return stored_line(folder, array, bounds, name)


def _numbers(told: Any, count: int) -> Float64Array:
    """Return the numbers of a list; ValueError unless there are so many."""
    if len(told) != count:
        raise ValueError(f"{len(told)} numbers for {count} axes")
    return np.array([float(number) for number in told])
