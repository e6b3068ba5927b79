"""Read a table of labels, their names and colours: of ITK-SNAP, FreeSurfer, 3D Slicer or BIDS.

    ITK-SNAP     number, red, green, blue, alpha, visible, mesh visible, "name"
    FreeSurfer   number, name, red, green, blue, alpha (FreeSurferColorLUT.txt; 3D Slicer's .ctbl)
    BIDS         columns with tabs between, index and name among them, perhaps color (#ff0000)

Lines that begin with # are remarks. Source: the programs' own files and documentation; BIDS 1.9,
segmentations.
"""

import re
from pathlib import Path

from dmc_cli.errors import VolumeError
from dmc_cli.volume import Color, Label

MOST_BYTES = 1 << 24
"""The longest table that is read; FreeSurfer's own has 60 kB."""

_ITK_SNAP = re.compile(r'\s*(\d+)\s+(\d+)\s+(\d+)\s+(\d+)\s+[\d.]+\s+\d\s+\d\s+"(.*)"\s*')
_FREESURFER = re.compile(r"\s*(\d+)\s+(\S+)\s+(\d+)\s+(\d+)\s+(\d+)\s+\d+\s*")
_HEX = re.compile(r"#?([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})")


def read_label_names(path: str) -> tuple[Label, ...]:
    """Return the labels that a table names; the background, 0, is left out.

    Raises:
        VolumeError: The file cannot be read, or is no such table.
    """
    try:
        with Path(path).open("rb") as file:
            text = file.read(MOST_BYTES).decode("utf-8-sig", "replace")
    except (OSError, ValueError) as error:
        raise VolumeError(f"{path}: the table of labels cannot be read ({error}); check the path") from error
    lines = text.splitlines()
    labels = _columns(lines) or [label for line in lines for label in _row(line)]
    if not labels:
        raise VolumeError(
            f"{path} names no labels; expected a table of ITK-SNAP, FreeSurfer or 3D Slicer, or of BIDS,"
            f" with the"
            " columns index and name; see docs/formats.md"
        )
    return tuple({label.number: label for label in labels if label.number}.values())


def table_beside(path: str) -> str | None:
    """Return the table of BIDS beside a segmentation `X_dseg.nii.gz`: `X_dseg.tsv`, or `dseg.tsv`."""
    name = Path(path).name
    stem = re.sub(r"\.nii(\.gz)?$", "", name)
    if stem == name or not stem.endswith("dseg"):
        return None
    for candidate in (f"{stem}.tsv", "dseg.tsv"):
        beside = Path(path).with_name(candidate)
        if beside.is_file():
            return str(beside)
    return None


def _row(line: str) -> list[Label]:
    """Return the label of a line of ITK-SNAP or FreeSurfer, or nothing."""
    if snap := _ITK_SNAP.fullmatch(line):
        number, name, color = snap[1], snap[5], snap.groups()[1:4]
    elif free := _FREESURFER.fullmatch(line):
        number, name, color = free[1], free[2], free.groups()[2:5]
    else:
        return []
    red, green, blue = (min(int(part), 255) for part in color)
    return [Label(value=int(number), number=int(number), name=name, color=(red, green, blue))]


def _columns(lines: list[str]) -> list[Label]:
    """Return the labels of a table with a line of titles, as BIDS has it; none of other files."""
    titles = [title.strip().lower() for title in lines[0].split("\t")] if lines else []
    if "index" not in titles or "name" not in titles:
        return []
    labels = []
    for line in lines[1:]:
        told = dict(zip(titles, (part.strip() for part in line.split("\t")), strict=False))
        if re.fullmatch(r"\d{1,9}", told.get("index", "")):
            number = int(told["index"])
            color = _color(told.get("color", ""))
            labels.append(Label(value=number, number=number, name=told.get("name", ""), color=color))
    return labels


def _color(text: str) -> Color | None:
    """Return a colour of six hexadecimal digits."""
    found = _HEX.fullmatch(text)
    if found is None:
        return None
    red, green, blue = (int(part, 16) for part in found.groups())
    return red, green, blue
