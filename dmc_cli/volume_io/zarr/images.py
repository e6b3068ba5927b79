"""Find the images of a Zarr store: an array itself, OME images of version 0.1 to 0.5, a bioformats2raw store.

Each has its axes and, where its metadata tell them, the distances of its nodes. Of an OME image it is the
finest level. Axes of version 0.4 and 0.5 have names and types, those of 0.3 names; before they were t, c, z,
y, x. Versions before 0.4 tell no distances.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.volume_io.axes import SPELLINGS, UNNAMED, Axis, Image, nameless_image
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.lengths import Doubts, missing_spacing
from dmc_cli.volume_io.units import scales_in_mm
from dmc_cli.volume_io.within import Bounds
from dmc_cli.volume_io.zarr.metadata import ZarrArray, read_node

OLD_AXES = "tczyx"
"""The axes of OME-Zarr 0.1 and 0.2, of which the first ones may be missing."""

LAYOUT = "bioformats2raw.layout"
"""The attribute of a group whose subgroups 0, 1, ... are the images of one file."""

MOST_IMAGES = 10_000
"""More images than a store of bioformats2raw has."""


@dataclass(frozen=True)
class StoredImage:
    """An array of a store, and what it is.

    Attributes:
        folder: The array's own folder.
        array: Its metadata.
        image: Its axes and its title.
        scale: Distance of the nodes along each axis in its unit, or None where nothing tells it.
        shift: Place of the first node along each axis, likewise.
        units: The axes' units as the metadata spell them, None for one without.
    """

    folder: Path
    array: ZarrArray
    image: Image
    scale: Float64Array | None = None
    shift: Float64Array | None = None
    units: tuple[str | None, ...] = ()

    def placed(self, name: str) -> tuple[Triple | None, Triple | None, Doubts]:
        """Return spacing and origin in millimetres along x, y, z, None where they are not told, and doubts.

        Raises:
            UnsupportedFormatError: An axis of space is measured in units of time.
        """
        assert self.image.grid is not None
        order = list(self.image.grid[::-1])
        units = [self.units[axis] if self.units else None for axis in order]
        if self.scale is None and units == [None] * 3:
            return None, None, ()
        scales, doubts = scales_in_mm(units, name, "the store")
        if self.scale is None:
            doubts = (*missing_spacing(dict(zip("xyz", scales, strict=True)), "the store"), *doubts)
        scale = np.ones(len(self.units)) if self.scale is None else self.scale
        shift = np.zeros(len(self.units)) if self.shift is None else self.shift
        with np.errstate(all="ignore"):  # what is not finite is refused with the lengths
            (x, y, z), (p, q, r) = ((lengths[order] * scales).tolist() for lengths in (scale, shift))
        return (x, y, z), (p, q, r), doubts


def stored_images(path: Path, bounds: Bounds, name: str) -> list[StoredImage]:
    """Return the images of a store.

    Raises:
        UnsupportedFormatError: There is none.
        VolumeError: Its metadata cannot be used, or lead out of it.
        ValueError, KeyError, TypeError, ...: They are not what the specifications say.
    """
    node = read_node(path, bounds, name)
    if isinstance(node, ZarrArray):
        return [StoredImage(path, node, Image(_plain_axes(node)))]
    attributes = _ome_attributes(node)
    if attributes.get("multiscales"):
        return _ome_images(path, attributes, bounds, name)
    if LAYOUT in attributes:
        return _bioformats_images(path, bounds, name)
    inner = sorted(entry.name for entry in os.scandir(path) if entry.is_dir())
    raise UnsupportedFormatError(
        f"{name}: a Zarr group without an OME image found, with {', '.join(inner)[:200]}; give the path of "
        "one of its arrays or images"
    )


def _ome_attributes(node: Any) -> dict[str, Any]:
    """Return the attributes of a group in which OME-Zarr keeps its own: since version 0.5 in `ome`."""
    attributes = node or {}
    return attributes.get("ome") or attributes


def _plain_axes(array: ZarrArray) -> tuple[Axis, ...]:
    """Return the axes of an array that is no OME image: by the names that are known, else unnamed."""
    known = {spelling for spellings in SPELLINGS.values() for spelling in spellings}
    if not any(named.lower() in known for named in array.names):
        return nameless_image(array.shape).axes
    names = array.names
    if len(names) != len(array.shape):
        raise ValueError(f"{len(names)} names of axes for an array of {len(array.shape)}")
    return tuple(
        Axis(named if named.lower() in known else UNNAMED, size)
        for named, size in zip(names, array.shape, strict=True)
    )


def _bioformats_images(path: Path, bounds: Bounds, name: str) -> list[StoredImage]:
    """Return the images of a store that bioformats2raw has made of a file with one or several."""
    told = _ome_attributes(read_node(path / "OME", bounds, name)) if (path / "OME").is_dir() else {}
    folders = [str(part) for part in told.get("series", ())] or sorted(
        (entry.name for entry in os.scandir(path) if entry.name.isdecimal() and entry.is_dir()), key=int
    )
    if len(folders) > MOST_IMAGES:
        raise ValueError(f"{len(folders)} images; expected {MOST_IMAGES} at most")
    found = []
    for folder in folders:
        inner = _within(path, folder, name)
        attributes = _ome_attributes(read_node(inner, bounds, name))
        if attributes.get("multiscales"):
            found += _ome_images(inner, attributes, bounds, name, f"image {folder}")
    if not found:
        raise UnsupportedFormatError(
            f"{name}: a store of bioformats2raw without an image found; expected 0, 1, ...; get it again"
        )
    return found


def _within(path: Path, told: str, name: str) -> Path:
    """Return a folder of a store by the path that its metadata have for it."""
    parts = [part for part in told.split("/") if part not in ("", ".")]
    if ".." in parts or any("\\" in part for part in parts):
        raise VolumeError(f"{name}: {told!r:.80} leads out of the store; expected a folder in it")
    return path.joinpath(*parts)


def _ome_images(
    path: Path, attributes: dict[str, Any], bounds: Bounds, name: str, title: str = ""
) -> list[StoredImage]:
    """Return the finest level of each image of a group."""
    channels = (attributes.get("omero") or {}).get("channels") or ()
    labels = tuple(str(channel.get("label", "")) for channel in channels)
    found = []
    for number, image in enumerate(attributes["multiscales"][:MOST_IMAGES]):
        level = image["datasets"][0]
        if "coordinateSystems" in image:
            raise UnsupportedFormatError(
                f"{name}: an OME image with coordinate systems found; expected OME-Zarr 0.1 to 0.5; "
                "convert it"
            )
        folder = _within(path, str(level["path"]), name)
        array = read_node(folder, bounds, name)
        if not isinstance(array, ZarrArray):
            raise DamagedVolumeError(
                f"{name}: level {level['path']!r} of the image is no array; get the data again"
            )
        axes = _ome_axes(image, array.shape, labels)
        scale, shift = _placed(image, level, name)
        titled = str(image.get("name") or title or f"image {number}")
        units = tuple(_unit(axis) for axis in image.get("axes", ()))
        found.append(StoredImage(folder, array, Image(axes, titled), scale, shift, units))
    return found


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


def _placed(image: Any, level: Any, name: str) -> tuple[Float64Array | None, Float64Array | None]:
    """Return distance and place along each axis, in its unit; None where no scale is told."""
    steps = [*level.get("coordinateTransformations", []), *image.get("coordinateTransformations", [])]
    if not any(step["type"] == "scale" for step in steps):
        if any(step["type"] != "identity" for step in steps):
            raise ValueError("a translation without a scale")
        return None, None
    dimension = len(image["axes"])
    scale, shift = np.ones(dimension), np.zeros(dimension)
    with np.errstate(all="ignore"):  # what is not finite is refused with the lengths
        for step in steps:
            if step["type"] == "scale":
                factors = _numbers(step["scale"], dimension)
                scale, shift = scale * factors, shift * factors
            elif step["type"] == "translation":
                shift = shift + _numbers(step["translation"], dimension)
            elif step["type"] != "identity":
                raise UnsupportedFormatError(
                    f"{name}: an OME image with a transformation {step['type']!r:.40} found; expected scale "
                    "and translation; resample the image along its axes"
                )
    return scale, shift


def _numbers(told: Any, count: int) -> Float64Array:
    """Return the numbers of a list; ValueError unless there are so many."""
    if len(told) != count:
        raise ValueError(f"{len(told)} numbers for {count} axes")
    return np.array([float(number) for number in told])
