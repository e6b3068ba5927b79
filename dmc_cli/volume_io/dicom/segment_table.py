"""Tell what a segmentation object calls its segments, and where each of them is (PS3.3, C.8.20)."""

from typing import Any

from dmc_cli.volume import Color, Label
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.labels import MOST_SEGMENTS, SEGMENT
from dmc_cli.volume_io.dicom.stack import Stack

ALL = "all"
"""What stands for the segment of a label map, whose pixels are the segments' numbers."""

_WHITE = (0.95047, 1.0, 1.08883)
"""X, Y, Z of the white of sRGB, D65."""

_LINEAR = ((3.2406, -1.5372, -0.4986), (-0.9689, 1.8758, 0.0415), (0.0557, -0.2040, 1.0570))
"""From X, Y, Z to linear red, green and blue (IEC 61966-2-1)."""


def segment_table(stacks: list[Stack], chosen: Stack) -> tuple[Label, ...]:
    """Return the segments of the series that a volume is of; none where it holds other images.

    Args:
        stacks: All that were found, in the order in which they are numbered.
        chosen: The one that is read.
    """
    own = [stack for stack in stacks if stack.uid == chosen.uid]
    if not all(SEGMENT in stack.frames[0].labels for stack in own):
        return ()
    found: list[Label] = []
    for layer, stack in enumerate(own):
        frame = stack.frames[0]
        items = {_number(item): item for item in _items(frame.header.dataset)}
        told = frame.labels[SEGMENT].partition(" ")[0]
        if told == ALL:
            found += [_label(number, number, item, layer) for number, item in items.items()]
        elif told.isdecimal():
            found.append(_label(int(told), 1, items.get(int(told)), layer))
    return tuple(found)


def _items(dataset: Any) -> list[Any]:
    """Return the descriptions of segments."""
    return elements.items(dataset, 0x00620002, MOST_SEGMENTS)


def _number(item: Any) -> int:
    return elements.integer(item, 0x00620004, 0) or 0


def _label(number: int, value: int, item: Any, layer: int) -> Label:
    """Return a segment whose nodes have a value in a layer, as its description has it, if there is one."""
    if item is None:
        return Label(value=value, number=number, layer=layer)
    stored = elements.numbers(item, 0x0062000D, 3)
    color = None if stored is None else _from_lab(stored)
    return Label(value=value, number=number, name=elements.text(item, 0x00620005), color=color, layer=layer)


def _from_lab(stored: list[float]) -> Color:
    """Return a Recommended Display CIELab Value, three numbers of 16 bits, as red, green and blue."""
    lightness = stored[0] / 65535 * 100
    a, b = (number / 65535 * 255 - 128 for number in stored[1:])
    middle = (lightness + 16) / 116
    ratios = (middle + a / 500, middle, middle - b / 200)
    xyz = [
        white * (ratio**3 if ratio > 6 / 29 else 3 * (6 / 29) ** 2 * (ratio - 4 / 29))
        for white, ratio in zip(_WHITE, ratios, strict=True)
    ]
    red, green, blue = (
        _gamma(sum(part * value for part, value in zip(row, xyz, strict=True))) for row in _LINEAR
    )
    return red, green, blue


def _gamma(linear: float) -> int:
    """Return a share of linear light as sRGB has it, 0 to 255."""
    light = min(max(linear, 0.0), 1.0)
    return round(255 * (12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055))
