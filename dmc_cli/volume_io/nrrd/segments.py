"""Read what 3D Slicer's segmentations (.seg.nrrd) call their segments: key-value pairs of the NRRD header.

Segments that overlap lie in several layers, along a first axis of the kind `list`; each has its layer and its
value there. Older files have a layer a segment, with the value 1. Source: Slicer's vtkSegmentation nodes, as
its documentation describes them.
"""

import re
from pathlib import Path

from dmc_cli.volume import Color, Label
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.nrrd.header import MAX_HEADER

PAIR = re.compile(rb"^Segment(\d{1,5})_(\w+):=([^\r\n]*)", re.MULTILINE)


def segment_labels(path: Path, name: str) -> tuple[Label, ...]:
    """Return the segments that a NRRD header names, in the order of their numbers; none of other files."""
    header = first_bytes(path, name, MAX_HEADER).partition(b"\n\n")[0]
    told: dict[int, dict[str, str]] = {}
    for number, key, value in PAIR.findall(header):
        told.setdefault(int(number), {})[key.decode()] = value.decode("utf-8", "replace").strip()
    rows = [(number, pairs) for number, pairs in sorted(told.items()) if {"ID", "Name"} & set(pairs)]
    values = [_whole(pairs.get("LabelValue"), 1) for _, pairs in rows]
    is_unique = len(set(values)) == len(values)
    return tuple(
        Label(
            value=value,
            number=value if is_unique else number + 1,
            name=pairs.get("Name", ""),
            color=_color(pairs.get("Color", "")),
            layer=_whole(pairs.get("Layer"), number if "LabelValue" not in pairs else 0),
        )
        for (number, pairs), value in zip(rows, values, strict=True)
    )


def _whole(text: str | None, otherwise: int) -> int:
    """Return a whole number, or another one where there is none."""
    return int(text) if text is not None and re.fullmatch(r"\d{1,9}", text) else otherwise


def _color(text: str) -> Color | None:
    """Return three shares of 1, with spaces between, as a colour."""
    try:
        red, green, blue = (round(255 * min(max(float(part), 0.0), 1.0)) for part in text.split())
    except ValueError:
        return None
    return red, green, blue
