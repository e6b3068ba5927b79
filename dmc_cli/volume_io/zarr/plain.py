"""Tell what an array of a Zarr store is that is no OME image: by its names, its places, its attributes.

xarray keeps, beside an array and in the same group, one of places for each axis, called like it.
"""

import os
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from dmc_cli.errors import AmbiguousVolumeError, DmcError, UnsupportedFormatError
from dmc_cli.volume_io.axes import UNNAMED, nameless_image
from dmc_cli.volume_io.loose_lengths import axis_names, loose_lengths
from dmc_cli.volume_io.places import Along, cf_axis, named_image, placed
from dmc_cli.volume_io.within import Bounds
from dmc_cli.volume_io.zarr.chunks import stored_line
from dmc_cli.volume_io.zarr.metadata import ZarrArray, read_node
from dmc_cli.volume_io.zarr.stored import StoredImage

MOST_PLACES = 1 << 24
"""Places along an axis that are read, at most."""

MOST_LOOKED_AT = 1000
"""Arrays of a group that are looked at, at most."""


def plain_image(path: Path, array: ZarrArray, name: str, bounds: Bounds) -> StoredImage:
    """Return an array with what its store tells of its axes.

    Args:
        path: Its own folder.
        array: Its metadata.
        name: The input, for messages.
        bounds: Where the store's files may lie, if it is one of a group that was given.

    Raises:
        ValueError: Other names than axes.
        UnsupportedFormatError: Places along an axis are not even.
    """
    names = array.names or axis_names(array.attributes, len(array.shape)) or ("",) * len(array.shape)
    if len(names) != len(array.shape):
        raise ValueError(f"{len(names)} names of axes for an array of {len(array.shape)}")
    group = Bounds(path.parent) if not bounds.hold(path.parent) else bounds
    along = [
        _along(named, size, path.parent, group, name) for named, size in zip(names, array.shape, strict=True)
    ]
    is_named = any(each.kind != UNNAMED for each in along)
    image = named_image(along) if is_named else nameless_image(array.shape)
    if image.grid is None:
        return StoredImage(path, array, image)
    spacing, origin, told = placed(image, along, name)
    if spacing is None and not told:
        owners = [("the array", array.attributes), ("its group", _group_attributes(path.parent, group, name))]
        spacing, origin, told = loose_lengths(owners, path.name)
    return StoredImage(path, array, image, plain=(spacing, origin, told))


def only_array(path: Path, bounds: Bounds, name: str) -> StoredImage:
    """Return the only array of a group that may be a volume.

    Raises:
        UnsupportedFormatError: There is none.
        AmbiguousVolumeError: There are several.
    """
    inner = sorted(entry.name for entry in os.scandir(path) if entry.is_dir())
    found = {}
    for entry in inner[:MOST_LOOKED_AT]:
        node = other_node(path / entry, bounds, name)
        if isinstance(node, ZarrArray) and sum(size > 1 for size in node.shape) >= 3:
            found[entry] = node
    if len(found) != 1:
        told = f"{name}: a Zarr group without an OME image found, with {', '.join(found or inner)[:200]}"
        if not found:
            raise UnsupportedFormatError(f"{told}; give the path of one of its arrays or images")
        first = f"{name.rstrip('/')}/{next(iter(found))}"
        raise AmbiguousVolumeError(f"{told}; give the path of one of its arrays, such as {first}")
    ((entry, array),) = found.items()
    return plain_image(path / entry, array, name, bounds)


def other_node(folder: Path, bounds: Bounds, name: str) -> Any:
    """Return an array or the attributes of a group beside the one that is meant, None where it is unusual.

    Raises:
        OSError: It is there and cannot be read.
    """
    with suppress(DmcError, FileNotFoundError, ValueError, KeyError, TypeError, AttributeError):
        return read_node(folder, bounds, name)
    return None


def _group_attributes(folder: Path, bounds: Bounds, name: str) -> dict[str, Any]:
    node = other_node(folder, bounds, name)
    return node if isinstance(node, dict) else {}


def _along(named: str, size: int, group: Path, bounds: Bounds, name: str) -> Along:
    """Return what a store says of an axis: its name, and the array of places that is called so."""
    if named in ("", ".", "..") or "/" in named or "\\" in named:
        return Along(named, size)
    node = other_node(group / named, bounds, name)
    if not isinstance(node, ZarrArray) or node.shape != (size,) or node.packing.dtype.kind not in "iuf":
        return Along(named, size)
    read = partial(stored_line, group / named, node, bounds, name) if size <= MOST_PLACES else None
    return Along(named, size, _text(node.attributes.get("units")), cf_axis(node.attributes, _text), read)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""
