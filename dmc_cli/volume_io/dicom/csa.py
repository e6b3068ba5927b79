"""Read what Siemens keeps in a header of its own (CSA): normals of slices, b-values, gradient directions.

It may be longer than the pixels, so it is read only where an image is a mosaic or where nothing else tells
images in one place apart.
"""

import warnings
from typing import Any

from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.effort import PiecewiseStream
from dmc_cli.volume_io.dicom.elements import Header
from dmc_cli.volume_io.dicom.makers import BLOCKS, CSA, CSA_GROUP
from dmc_cli.volume_io.library_errors import library_errors

MOST_BYTES = 1 << 20
"""A longer one is no header."""

BYTES_A_PIECE = 16
"""What each of its pieces takes, at least."""

LABELS = {"B_value": "b-value", "DiffusionGradientDirection": "gradient direction"}
"""Fields that tell images in one place apart, in the words of the standard's elements."""


def csa_values(header: Header) -> dict[str, list[Any]]:
    """Return the values of each field of an image's CSA header; none where it has none that can be read."""
    blocks = [block for block in BLOCKS if elements.text(header.dataset, CSA_GROUP << 16 | block) == CSA]
    found: dict[str, list[Any]] = {}
    for block in blocks:
        tag = CSA_GROUP << 16 | block << 8 | 0x10
        content = elements.content(read_again(header, [tag]), tag)
        if 0 < len(content) <= MOST_BYTES:
            header.file.effort.take_pieces(len(content) // BYTES_A_PIECE + 1)
            found.update(_fields(content))
    return found


def read_again(header: Header, tags: list[int]) -> Any:
    """Return the data set of elements that only few images are asked for.

    Raises:
        DamagedVolumeError: The header cannot be read once more.
    """
    import pydicom

    wanted: Any = tags
    # as `header.read_header`: pydicom raises whatever its parsing runs into
    with (
        library_errors(f"{header.file.name}: the DICOM header cannot be read"),
        header.file.open((header.pixel_start or 0) + 8) as file,
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        stream: Any = PiecewiseStream(file, header.file.effort)
        return pydicom.dcmread(stream, stop_before_pixels=True, force=True, specific_tags=wanted)


def _fields(content: bytes) -> dict[str, list[Any]]:
    with warnings.catch_warnings():
        # nibabel calls its readers of DICOM experimental; this one has been the same for ten years
        warnings.simplefilter("ignore")
        from nibabel.nicom.csareader import read
    try:
        fields = read(content)["tags"]
    except Exception:
        # whatever a damaged one runs nibabel into: it says nothing then
        return {}
    return {name: field["items"] for name, field in fields.items() if field["items"]}


def csa_labels(values: dict[str, list[Any]]) -> dict[str, str]:
    """Return what the fields tell of diffusion, numbers as `elements.label` writes them."""
    found = {}
    for name, label in LABELS.items():
        numbers = [value for value in values.get(name, []) if isinstance(value, (int, float))]
        digits = 10 if len(numbers) == 1 else 6
        if numbers:
            found[label] = " ".join(f"{value:.{digits}g}" for value in numbers)
    return found
