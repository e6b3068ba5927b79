"""Hold a volume: stored values on a regular grid, and what they mean.

Conventions: a node is a grid sample; indices i, j, k run along x, y, z; the array is [k, j, i],
x fastest. Values stay as they were stored: physical value = slope * stored value + intercept.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import VolumeError
from dmc_cli.notices import Notice
from dmc_cli.volume.checks import (
    checked_affine,
    checked_padding,
    checked_positions,
    checked_scale,
    checked_values,
)
from dmc_cli.volume.label_table import Label

Space = Literal["RAS", "LPS", "none"]

PointFunction = Callable[[Float64Array], Float64Array]
"""Points, (N, 3) float64, to values or gradients there."""


@dataclass(frozen=True, kw_only=True)
class VolumeEntry:
    """One volume of an input, as `dmc info` lists it, without its values.

    Attributes:
        number: What `--series` takes to choose it, from 1.
        description: The series' own description, or the format's name.
        modality: DICOM's modality (CT, MR, ...), else empty.
        size: Nodes along x, y, z.
        uid: DICOM's SeriesInstanceUID, else empty.
        volumes: Where there are several to choose from by `--volume-index`: what each of them is, in order.
    """

    number: int = 1
    description: str = ""
    modality: str = ""
    size: tuple[int, int, int]
    uid: str = ""
    volumes: tuple[str, ...] = ()

    @property
    def slices(self) -> int:
        """Return the number of slices."""
        return self.size[2]


@dataclass(frozen=True, kw_only=True)
class Volume:
    """A scan or field as it was stored, with the map to the world; checked when it is made.

    Attributes:
        values: Stored values, shape (nz, ny, nx), C-contiguous, native byte order, an integer type of
            8 to 64 bits or float32 or float64; a read-only view of the array that was given, which is to
            stay as it is while the volume is used, or of a memory map where the file allows it. An array of
            other byte order, strides, half floats or truth values is copied into one of these.
        affine: Shape (4, 4), float64: node index (i, j, k, 1) to millimetres in `space`.
        space: The world's axes: RAS, LPS, or none where the format tells no orientation.
        slope: Physical value a stored unit; never 0.
        intercept: Physical value of stored 0.
        padding: Closed range of stored values that mean "no data" (DICOM's PixelPaddingValue), or None.
            NaN and infinity always mean no data.
        slice_positions: Unevenly spaced slices: shape (nz,), float64, millimetres of slice k along the
            affine's third axis, from 0 and increasing; node (i, j, k) lies at the affine's image of
            (i, j, slice_positions[k] / spacing[2]), and between two slices positions are linear in k.
            None where slice k lies at k * spacing[2].
        path: The input as the user named it.
        files: The files that were read, in slice order.
        format: The reader's name: one of those of `volume_formats.FORMATS`, or synthetic.
        warnings: What the user is told, for example of a missing orientation.
        modality: What it was made by, as the file says in DICOM's words (CT, MR, ...), else empty.
        value_unit: What physical values are measured in by the file's own statement (HU), else empty.
        gradient: The exact gradient of the field that the values are samples of, if it is known: points to
            gradients, both (N, 3) float64, the points in millimetres as `affine` has them; only directions
            count. None of a scan.
        formula: That field itself, if it is known: points (N, 3) to physical values (N,).
        labels: What the file calls the values of a label map, its other volumes' among them; mostly none.
    """

    values: AnyArray
    affine: Float64Array
    space: Space
    slope: float = 1.0
    intercept: float = 0.0
    padding: tuple[float, float] | None = None
    slice_positions: Float64Array | None = None
    path: str = ""
    files: tuple[Path, ...] = ()
    format: str = ""
    warnings: tuple[Notice, ...] = ()
    modality: str = ""
    value_unit: str = ""
    gradient: PointFunction | None = None
    formula: PointFunction | None = None
    labels: tuple[Label, ...] = ()

    def __post_init__(self) -> None:
        """Convert or refuse, once, at the door.

        Raises:
            VolumeError: What is given is no volume.
        """
        name = self.path or "the volume"
        if not isinstance(self.space, str) or self.space not in get_args(Space):
            raise VolumeError(
                f"{name}: space {self.space!r} found; expected one of {', '.join(get_args(Space))}"
            )
        for function in ("gradient", "formula"):
            given = getattr(self, function)
            if given is not None and not callable(given):
                raise VolumeError(
                    f"{name}: {function} is {given!r:.80}; expected a function of points, or None"
                )
        slope, intercept = checked_scale(name, self.slope, self.intercept)
        held: dict[str, Any] = {
            "slope": slope,
            "intercept": intercept,
            "padding": checked_padding(name, self.padding),
            "values": checked_values(name, self.values),
            "affine": checked_affine(name, self.affine),
        }
        if self.slice_positions is not None:
            step = float(np.linalg.norm(held["affine"][:3, 2]))
            held["slice_positions"] = checked_positions(name, self.slice_positions, len(held["values"]), step)
        for attribute, value in held.items():
            object.__setattr__(self, attribute, value)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the number of nodes along x, y, z."""
        nz, ny, nx = self.values.shape
        return nx, ny, nz

    @property
    def spacing(self) -> tuple[float, float, float]:
        """Return the distance of neighbouring nodes along x, y, z in millimetres."""
        x, y, z = np.linalg.norm(self.affine[:3, :3], axis=0)
        return float(x), float(y), float(z)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Return what the warnings say."""
        return tuple(notice.sentence for notice in self.warnings)

    def value_range(self) -> tuple[float, float] | None:
        """Return the smallest and largest finite physical value that is data, or None where there is none."""
        low, high = _stored_range(self.values, self.padding)
        if low is None or high is None:
            return None
        ends = sorted((self.slope * low + self.intercept, self.slope * high + self.intercept))
        return ends[0], ends[1]


def _stored_range(values: AnyArray, padding: tuple[float, float] | None) -> tuple[float | None, float | None]:
    """Return the smallest and largest stored value that is data, slice by slice to keep memory small."""
    low: float | None = None
    high: float | None = None
    for plane in values:
        data = plane
        if plane.dtype.kind == "f":
            data = data[np.isfinite(data)]
        if padding is not None:
            first, last = padding
            if plane.dtype.kind == "f":  # else NumPy would round them to float32
                first, last = np.float64(first), np.float64(last)
            data = data[(data < first) | (data > last)]
        if data.size:
            plane_low, plane_high = float(data.min()), float(data.max())
            low = plane_low if low is None else min(low, plane_low)
            high = plane_high if high is None else max(high, plane_high)
    return low, high
