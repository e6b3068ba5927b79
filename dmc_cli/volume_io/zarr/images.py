"""Find the images of a Zarr store: an array, a group of arrays, OME images, a store of bioformats2raw."""

import os
from contextlib import suppress
from pathlib import Path

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.volume_io.within import Bounds
from dmc_cli.volume_io.zarr.metadata import ZarrArray, read_node
from dmc_cli.volume_io.zarr.ome import MOST_IMAGES, ome_attributes, ome_images, within_store
from dmc_cli.volume_io.zarr.plain import only_array, other_node, plain_image
from dmc_cli.volume_io.zarr.stored import StoredImage

LAYOUT = "bioformats2raw.layout"
"""The attribute of a group whose subgroups 0, 1, ... are the images of one file."""


def stored_images(path: Path, bounds: Bounds, name: str) -> list[StoredImage]:
    """Return the images of a store.

    Raises:
        UnsupportedFormatError: There is none.
        AmbiguousVolumeError: A group with several arrays that are no OME image.
        VolumeError: Its metadata cannot be used, or lead out of it.
        ValueError, KeyError, TypeError, ...: They are not what the specifications say.
    """
    node = read_node(path, bounds, name)
    if isinstance(node, ZarrArray):
        return _level(path, bounds, name)[:1] or [plain_image(path, node, name, bounds)]
    attributes = ome_attributes(node)
    if attributes.get("multiscales"):
        return ome_images(path, attributes, bounds, name)
    if LAYOUT in attributes:
        return _bioformats_images(path, bounds, name)
    return [only_array(path, bounds, name)]


def _level(path: Path, bounds: Bounds, name: str) -> list[StoredImage]:
    """Return the level of an OME image whose array was given, or nothing where it is none."""
    group = bounds if bounds.hold(path.parent) else Bounds(path.parent)
    attributes = ome_attributes(other_node(path.parent, group, name))
    with suppress(ValueError, LookupError, TypeError, AttributeError):
        if attributes.get("multiscales"):
            return ome_images(path.parent, attributes, group, name, wanted=path.name)
    return []


def _bioformats_images(path: Path, bounds: Bounds, name: str) -> list[StoredImage]:
    """Return the images of a store that bioformats2raw has made of a file with one or several."""
    told = ome_attributes(read_node(path / "OME", bounds, name)) if (path / "OME").is_dir() else {}
    folders = [str(part) for part in told.get("series", ())] or sorted(
        (entry.name for entry in os.scandir(path) if entry.name.isdecimal() and entry.is_dir()), key=int
    )
    if len(folders) > MOST_IMAGES:
        raise ValueError(f"{len(folders)} images; expected {MOST_IMAGES} at most")
    found = []
    for folder in folders:
        inner = within_store(path, folder, name)
        attributes = ome_attributes(read_node(inner, bounds, name))
        if attributes.get("multiscales"):
            found += ome_images(inner, attributes, bounds, name, f"image {folder}")
    if not found:
        raise UnsupportedFormatError(
            f"{name}: a store of bioformats2raw without an image found; expected 0, 1, ...; get it again"
        )
    return found
