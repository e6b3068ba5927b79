"""Tell in words what the volumes of a PAR header are: dynamics, echoes, phases, types, diffusion.

Dynamics are times, and so are cardiac phases where there is one dynamic. Volumes that are not all
combinations of what differs are one axis, each told by what it is.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.volume_io.axes import Axis, Image, stacked_image

_TYPES = {0: "magnitude", 1: "real", 2: "imaginary", 3: "phase"}

FACTORS: dict[str, tuple[str, ...]] = {
    "time": ("dynamic scan number",),
    "cardiac phase": ("cardiac phase number",),
    "echo": ("echo number",),
    "image type": ("image_type_mr",),
    "diffusion": ("diffusion b value number", "gradient orientation number"),
    "label type": ("label type",),
    "sequence": ("scanning sequence",),
}
"""What volumes differ in, and the columns that count it, as far as a version has them."""

_TOLD: dict[str, Callable[[Any], str]] = {
    "time": lambda line: f"dynamic {line['dynamic scan number']}, {line['dyn_scan_begin_time']:g} s",
    "cardiac phase": lambda line: f"phase {line['cardiac phase number']}, {line['trigger_time']:g} ms",
    "echo": lambda line: f"{line['echo_time']:g} ms",
    "image type": lambda line: _TYPES.get(int(line["image_type_mr"]), f"type {line['image_type_mr']}"),
    "diffusion": lambda line: f"b {line['diffusion_b_factor']:g}{_direction(line)}",
    "label type": lambda line: f"type {line['label type']}",
    "sequence": lambda line: f"sequence {line['scanning sequence']}",
}
"""How a line of the header tells each of them."""


def parrec_image(lines: AnyArray, nodes: tuple[int, int, int]) -> Image:
    """Return the volumes of a header as axes.

    Args:
        lines: A line of the header for each volume, in their order.
        nodes: Along x, y, z.
    """
    places = {name: _places(lines, columns) for name, columns in FACTORS.items()}
    several = [name for name, place in places.items() if place.any()]
    several = [name for name in several if not _follows(name, several, places)]
    sizes = {name: int(places[name].max()) + 1 for name in several}
    # the slowest changes last
    order = sorted(several, key=lambda name: -int(np.argmax(places[name] != 0)))
    index = np.zeros(len(lines), np.int64)
    for name in order:
        index = index * sizes[name] + places[name]
    if math.prod(sizes.values()) == len(lines) and np.array_equal(index, np.arange(len(lines))):
        axes = [Axis(name, sizes[name], _labels(name, lines, places[name])) for name in order]
    else:
        named = [*several, *([] if "diffusion" in several else ["diffusion"])]
        told = tuple(", ".join(f"{name} {_TOLD[name](line)}" for name in named) for line in lines)
        axes = [Axis("volume", len(lines), told)] if len(lines) > 1 else []
    return stacked_image(nodes, *map(_as_time, axes) if "time" not in order else axes)


def _as_time(axis: Axis) -> Axis:
    """Return the phases of the heart as times."""
    return Axis("time", axis.size, axis.labels) if axis.name == "cardiac phase" else axis


def _places(lines: AnyArray, columns: tuple[str, ...]) -> AnyArray:
    """Return for each line which of the different entries of some columns it has, in the order they come."""
    known = [lines[column] for column in columns if column in (lines.dtype.names or ())]
    seen: dict[tuple[int, ...], int] = {}
    rows = zip(*known, strict=True) if known else [()] * len(lines)
    return np.array([seen.setdefault(tuple(map(int, row)), len(seen)) for row in rows])


def _follows(name: str, several: list[str], places: dict[str, AnyArray]) -> bool:
    """Return whether a factor that comes before tells this one, too, as a type of images its sequence."""
    before = several[: several.index(name)]
    return any(len({*zip(places[b], places[name], strict=True)}) == len({*places[b]}) for b in before)


def _labels(name: str, lines: AnyArray, places: AnyArray) -> tuple[str, ...]:
    """Return how each entry of a factor is told, by the first line that has it."""
    firsts = [int(np.argmax(places == number)) for number in range(int(places.max()) + 1)]
    return tuple(_TOLD[name](lines[first]) for first in firsts)


def _direction(line: Any) -> str:
    """Return the direction of a gradient, or nothing for none or a version that has none."""
    if "diffusion" not in line.dtype.names or not line["diffusion"].any():
        return ""
    return " along " + " ".join(f"{part:g}" for part in line["diffusion"])
