"""Find an OME-TIFF of several files in a folder: metadata say which file is which plane, not the names."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from dmc_cli.errors import UnsupportedFormatError


@dataclass(frozen=True)
class OmeSet:
    """An OME-TIFF of several files.

    Attributes:
        first: The file that stands for them all.
        names: Those of all of them.
    """

    first: Path
    names: frozenset[str]


def ome_set(files: list[Path], tifffile: Any, name: str) -> OmeSet | None:
    """Return the OME-TIFF that a folder's TIFF files are, or None where they are slices by themselves.

    Args:
        files: All of them.
        tifffile: The package.
        name: The input, for messages.

    Raises:
        UnsupportedFormatError: Their metadata say that they are no slices, or lie in another file.
    """
    first = min(files)
    with tifffile.TiffFile(first) as tiff:
        xml = tiff.ome_metadata if tiff.is_ome else None
        pages = len(tiff.pages)
    try:
        root = ElementTree.fromstring(xml or "")
    except ElementTree.ParseError:
        return None
    elements = [*root.iter()]
    companion = next((each for each in elements if each.tag.endswith("}BinaryOnly")), None)
    if companion is not None:
        raise UnsupportedFormatError(
            f"{name}: {first.name} says that its metadata are in {companion.get('MetadataFile', '?')[:200]}, "
            "which is not read; expected them in the TIFF; convert the images to one OME-TIFF"
        )
    named = {each.get("FileName", "") for each in elements if each.tag.endswith("}UUID")} - {""}
    there = {file.name for file in files}
    if len(named) > 1 and first.name in named and named <= there:
        return OmeSet(first, frozenset(named))
    for pixels in (each for each in elements if each.tag.endswith("}Pixels")):
        others = math.prod(int(pixels.get(f"Size{axis}", "1")) for axis in "CT")
        if pages == 1 and others > 1 and int(pixels.get("SizeZ", "1")) == 1:
            raise UnsupportedFormatError(
                f"{name}: {first.name} is one of {others} channels or times by its OME metadata; expected "
                "slices along z; where they are slices in truth, correct the metadata"
            )
    return None
