"""Check what the XML of an OME-TIFF promises before tifffile believes it: planes, files, lengths.

tifffile makes a list entry for each plane that the XML names, and opens whatever file it names.
"""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.layout import check_file, exists
from dmc_cli.volume_io.units import length_of
from dmc_cli.volume_io.within import check_beside

MOST_PLANES = 1 << 20
"""More planes than any image has."""

MOST_REPEATS = 16
"""Times that the same plane may be named, on the average."""


def check_ome(xml: str, pages: int, path: Path, name: str, allow_outside: bool) -> None:
    """Refuse XML that names too many planes, or files elsewhere.

    Args:
        xml: The description of the first page.
        pages: How many there are.
        path: The file.
        name: The input, for messages.
        allow_outside: Whether files may lie outside the file's folder.

    Raises:
        DamagedVolumeError: It promises more than any image has.
        VolumeError: It names a file that is not to be read.
    """
    try:
        root = ElementTree.fromstring(xml)
    except ElementTree.ParseError:
        return  # then tifffile takes the pages as they are
    for pixels in _all(root, "Pixels"):
        planes = math.prod(int(pixels.get(f"Size{axis}", "1")) for axis in "ZCT")
        named = sum(_named_planes(data, max(pages, planes)) for data in _all(pixels, "TiffData"))
        if not 1 <= planes <= MOST_PLANES or named > MOST_REPEATS * max(pages, planes):
            raise DamagedVolumeError(
                f"{name}: OME metadata with {planes} planes, {named} times named, found for {pages} page(s); "
                "expected one page a plane; get the file again"
            )
    for element in root.iter():
        _check_labels(element, name)
        other = element.get("FileName", "")
        if other and element.tag.endswith("UUID") and other.lower() != path.name.lower():
            found = path.parent / other
            check_beside(path, found, other, name, allow_outside)
            if exists(found):
                check_file(found, f"{name} ({other[:200]})")


def _all(element: ElementTree.Element, tag: str) -> Iterator[ElementTree.Element]:
    return (each for each in element.iter() if each.tag.endswith(tag))


def _named_planes(data: ElementTree.Element, most: int) -> int:
    """Return how many planes an element TiffData stands for."""
    told = int(data.get("PlaneCount", data.get("NumPlanes", "1" if "IFD" in data.attrib else "0")))
    if told < 0 or abs(int(data.get("IFD", "0"))) > 1 << 31:
        raise ValueError("a negative number of planes")
    return told or most


def _check_labels(element: ElementTree.Element, name: str) -> None:
    """Refuse an axis of more labels than planes: tifffile makes an array of them."""
    if "Start" not in element.attrib or "End" not in element.attrib:
        return
    begin, end, step = (float(element.get(key, "1")) for key in ("Start", "End", "Step"))
    if not (step and abs((end - begin) / step) < MOST_PLANES):
        raise DamagedVolumeError(
            f"{name}: OME metadata with an axis from {begin:g} to {end:g} by {step:g} found; expected at "
            f"most {MOST_PLANES} labels; get the file again"
        )


def ome_channels(xml: str) -> list[tuple[str, ...]]:
    """Return the names of the channels of each image, "" for one without a name; none of what is no XML."""
    try:
        root = ElementTree.fromstring(xml)
    except ElementTree.ParseError:
        return []
    return [
        tuple(channel.get("Name", "") for channel in _all(pixels, "}Channel"))
        for pixels in _all(root, "}Pixels")
    ]


def check_modulo(xml: str, name: str) -> None:
    """Refuse slices that an annotation of Bio-Formats divides into those of several angles or the like.

    Raises:
        UnsupportedFormatError: Places along z stand for something else as well.
    """
    found = re.search(r'<(?:\w+:)?ModuloAlongZ\b[^>]*?\bType="([^"]{1,40})"', xml)
    if found:
        raise UnsupportedFormatError(
            f"{name}: slices along z that are {found[1]}s, too, found (ModuloAlongZ); expected slices alone; "
            "write each into a file of its own"
        )


def steps_of_planes(pixels: ElementTree.Element) -> list[float]:
    """Return the distances in millimetres from slice to slice that an image's planes have by their positions.

    None where their unit is no length, as by default: they are the stage's then.
    """
    heights = {}
    for plane in _all(pixels, "}Plane"):
        length = length_of(plane.get("PositionZUnit", "reference frame"))
        if (
            length is not None
            and plane.get("TheC") == plane.get("TheT") == "0"
            and "PositionZ" in plane.attrib
        ):
            heights[int(plane.get("TheZ", "0"))] = float(plane.get("PositionZ", "nan")) * length
    return [heights[k + 1] - heights[k] for k in sorted(heights) if k + 1 in heights]
