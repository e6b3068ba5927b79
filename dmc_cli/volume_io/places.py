"""Tell what an array's axes are by the places of their nodes: names, units, coordinates beside the values.

HDF5 (NeXus, netCDF) and Zarr (xarray) name axes and keep an array of places for each. By the Climate and
Forecast conventions (CF 4) such an array may say which axis it is of: `axis`, `standard_name`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.volume_io.axes import SPELLINGS, UNNAMED, Axis, Image
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.units import is_time, length_of

NO_LENGTHS = frozenset(
    (
        *("deg", "degree", "degrees", "rad", "radian", "radians", "mrad", "ev", "kev", "mev", "j", "joule"),
        *("degrees_north", "degree_north", "degrees_east", "degree_east", "degrees_n", "degrees_e"),
        *("k", "kelvin", "degc", "celsius", "pa", "hpa", "kpa", "mpa", "bar", "mbar", "t", "tesla"),
        *("v", "volt", "mv", "%"),
        *("1/angstrom", "angstrom^-1", "angstrom-1", "1/a", "a^-1", "1/nm", "nm^-1", "1/m", "m^-1"),
    )
)
"""Units, in lower case, of axes that are none of space."""

NO_SPACE = frozenset(
    (
        *("theta", "phi", "omega", "chi", "angle", "angles", "rotation", "tilt", "projection", "projections"),
        *("energy", "wavelength", "frequency", "temperature", "pressure", "tof", "time_of_flight"),
        *("frame_number", "q", "qx", "qy", "qz", "q_x", "q_y", "q_z", "image", "images", "scan"),
        *("polarization", "echo", "position", "positions", "tile", "tiles", "view", "views", "sample"),
        *("samples", "component"),
    )
)
"""Names of axes, in lower case, that count something else than places."""

CF_AXES = {"x": "x", "y": "y", "z": "z", "t": "time"}
CF_NAMES = {
    **{"projection_x_coordinate": "x", "grid_longitude": "x", "projection_y_coordinate": "y"},
    **{"depth": "z", "height": "z", "altitude": "z", "time": "time"},
}
"""What an axis is by CF's attributes `axis` and `standard_name`, in lower case."""

UNEVEN = 1e-3
"""A part of their mean by which distances of nodes may differ."""


@dataclass(frozen=True)
class Along:
    """What a file says of an axis.

    Attributes:
        label: What it is called, "" where nothing names it.
        size: Nodes, or what else it counts.
        unit: The unit of its places.
        told: What it is by CF's attributes, in lower case: `axis`, else `standard_name`.
        read: Returns the places of its nodes, shape (size,); None where the file has none.
    """

    label: str
    size: int
    unit: str = ""
    told: str = ""
    read: Callable[[], AnyArray] | None = None

    @property
    def kind(self) -> str:
        """Return its name as `Axis` has it, `UNNAMED` where it may be one of space."""
        plain = self.label.lower().removeprefix("tomo_").removesuffix("_pixel").strip()
        kind = Axis(plain, 1).kind
        if is_time(self.unit):
            return "time"
        is_other = length_of(self.unit) is None and self.unit.strip().lower() in NO_LENGTHS
        if self.told in CF_AXES or self.told in CF_NAMES:
            kind = CF_AXES.get(self.told) or CF_NAMES[self.told]
            return self.label if is_other and kind in "xyz" else kind
        if kind in SPELLINGS and not (is_other and kind in "xyz"):
            return kind
        return self.label if is_other or plain in NO_SPACE or "angle" in plain else UNNAMED


def cf_axis(attributes: Any, text_of: Callable[[Any], str]) -> str:
    """Return what CF's attributes of an array of places say it is of, in lower case, or nothing."""
    told = text_of(attributes.get("axis", "")) or text_of(attributes.get("standard_name", ""))
    return told.strip().lower()


def named_image(along: Sequence[Along], title: str = "") -> Image:
    """Return an image whose axes are called as a file calls them.

    A height beside a y is the third axis of space, as CF has it, and not that of an image.
    """
    kinds = [each.kind for each in along]
    heights = [n for n, each in enumerate(along) if each.label.lower() == "height" and kinds[n] == "y"]
    if heights and kinds.count("y") > 1 and "z" not in kinds:
        kinds[heights[0]] = "z"
    return Image(tuple(Axis(kind, each.size) for kind, each in zip(kinds, along, strict=True)), title)


def placed(
    image: Image, along: Sequence[Along], name: str
) -> tuple[Triple | None, Triple | None, tuple[Notice, ...]]:
    """Return distances and the first node's place along x, y, z in mm, None where they are not all told.

    Raises:
        UnsupportedFormatError: The nodes of an axis are not even.
    """
    assert image.grid is not None
    steps: list[float | None] = []
    first: list[float] = []
    notices: list[Notice] = []
    for number in image.grid:
        step, start, told = _axis(along[number], name)
        steps.append(step)
        first.append(start)
        notices += told
    z, y, x = steps
    k, j, i = first
    if x is None or y is None or z is None:
        missing = [label for label, step in zip("zyx", steps, strict=True) if step is None]
        if len(missing) < 3 and not notices:
            sentence = f"no places along {' and '.join(missing)}; those of the other axes are not used"
            notices.append(Notice("W-SPACING-MISSING", sentence))
        return None, None, tuple(notices)
    return (x, y, z), (i, j, k), tuple(notices)


def _axis(along: Along, name: str) -> tuple[float | None, float, list[Notice]]:
    """Return the distance of the nodes along an axis and the place of the first, in mm, and what is told."""
    if along.read is None or along.size < 2:
        return None, 0.0, []
    scale = length_of(along.unit)
    if scale is None:
        code, told = (
            ("W-UNIT-UNKNOWN", f"unit {along.unit[:20]!r}") if along.unit else ("W-UNIT-MISSING", "no unit")
        )
        sentence = f"the axis {along.label} has {told}; its places are not used; --spacing gives the lengths"
        return None, 0.0, [Notice(code, sentence)]
    values = scale * np.asarray(along.read(), np.float64)
    steps = np.diff(values)
    step = float(steps.mean())
    if not np.isfinite(values).all() or step == 0 or np.abs(steps - step).max() > UNEVEN * abs(step):
        raise UnsupportedFormatError(
            f"{name}: places along the axis {along.label} found that are not even; expected equal distances; "
            "resample the volume"
        )
    return step, float(values[0]), []
