"""Read what an HDF5 file says of a dataset's axes: NeXus' axes with their units, ITK's, element sizes.

NeXus: NXdata's attribute `axes` names a dataset of places along each axis, with its `units`. ITK keeps
spacing, origin and directions beside the values, in mm, axes x, y, z, in LPS. `element_size_um` (z, y, x) is
what microscopists' programs write. Other attributes that look like lengths have no unit and are told.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.volume import Space
from dmc_cli.volume_io.hdf5.dataset import ITK_VALUES, followed, text_of
from dmc_cli.volume_io.hdf_storage import check_inside, check_stored
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.units import is_time, length_of

_Float64 = np.ndarray[Any, np.dtype[np.float64]]

LOOSE_LENGTHS = ("spacing", "resolution", "voxel_size", "voxel_spacing", "pixel_size", "pixelsize", "scale")
"""Attributes of lengths that no standard gives a unit."""

ANGLES = ("deg", "degree", "degrees", "rad", "radian", "radians", "mrad")

UNEVEN = 1e-3
"""A part of their mean by which distances of nodes may differ."""


@dataclass(frozen=True)
class HdfGeometry:
    """What a file says of a dataset.

    Attributes:
        order: The dataset's axes that are z, y and x.
        spacing: Distances along x, y, z in mm, or None where they are not told.
        origin: Place of the first node in mm, or None.
        directions: Shape (3, 3): columns are the axes x, y, z in the world.
        space: The world's axes.
        notices: What is not used.
    """

    order: tuple[int, int, int]
    spacing: Triple | None = None
    origin: Triple | None = None
    directions: _Float64 | None = None
    space: Space = "none"
    notices: tuple[Notice, ...] = ()


def hdf_geometry(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> HdfGeometry:
    """Return what a file says of a dataset's axes, itself or in the group that it is named in.

    Raises:
        UnsupportedFormatError: One of them is a time or an angle.
    """
    last = (dataset.ndim - 3, dataset.ndim - 2, dataset.ndim - 1)
    if dataset.name == ITK_VALUES:
        return _itk(file, last, name)
    sizes = _numbers(dataset.attrs.get("element_size_um"))
    if len(sizes) == 3:
        z, y, x = (1e-3 * size for size in sizes)
        return HdfGeometry(last, (x, y, z))
    axes = _axes(file, dataset, group, name, h5py)
    if axes is not None:
        return axes
    loose = [key for key in LOOSE_LENGTHS if key in dataset.attrs]
    told = tuple(
        Notice(
            "W-UNIT-MISSING",
            f"the attribute {key!r} of {dataset.name} has no unit and is not used; --spacing gives lengths",
        )
        for key in loose
    )
    return HdfGeometry(last, notices=told)


def _itk(file: Any, last: tuple[int, int, int], name: str) -> HdfGeometry:
    """Return the geometry of an image that ITK wrote; a row of its directions is an axis."""
    told = [file[f"/ITKImage/0/{key}"] for key in ("Spacing", "Origin", "Directions")]
    if [dataset.shape for dataset in told] != [(3,), (3,), (3, 3)]:
        raise ValueError("spacing, origin and directions of another shape than those of three axes")
    for dataset in told:
        check_inside(dataset, name)
        check_stored(dataset, file.id.get_filesize(), name, "copy it with h5repack")
    x, y, z = (float(length) for length in told[0][()])
    i, j, k = (float(place) for place in told[1][()])
    directions = np.asarray(told[2][()], np.float64).T
    return HdfGeometry(last, (x, y, z), (i, j, k), directions, "LPS")


def _numbers(value: Any) -> list[float]:
    try:
        return [float(number) for number in np.atleast_1d(value)]
    except (TypeError, ValueError):
        return []


def _axes(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> HdfGeometry | None:
    """Return the geometry by the axes that NXdata names, or None where it names none."""
    named = group.attrs.get("axes", dataset.attrs.get("axes"))
    labels = [text_of(label) for label in np.atleast_1d(named)] if named is not None else []
    if len(labels) == 1 and len(labels) < dataset.ndim:
        labels = labels[0].replace(",", ":").split(":")
    if len(labels) != dataset.ndim:
        return None
    order = _order(labels)
    steps: list[float | None] = []
    first: list[float] = []
    notices: list[Notice] = []
    for axis in order:
        places = None if labels[axis] == "." else followed(file, f"{group.name}/{labels[axis]}", name, h5py)
        is_told = isinstance(places, h5py.Dataset) and places.shape == (dataset.shape[axis],)
        step, start, told = _axis(places, labels[axis], name) if is_told else (None, 0.0, [])
        steps.append(step)
        first.append(start)
        notices += told
    z, y, x = steps
    k, j, i = first
    if x is None or y is None or z is None:
        return HdfGeometry(order, notices=tuple(notices))
    return HdfGeometry(order, (x, y, z), (i, j, k), notices=tuple(notices))


def _order(labels: list[str]) -> tuple[int, int, int]:
    """Return which axes are z, y and x: by their names where these say so, else the last three."""
    found = {label.lower().removeprefix("tomo_").removesuffix("_pixel"): k for k, label in enumerate(labels)}
    if {"x", "y", "z"} <= {*found}:
        return found["z"], found["y"], found["x"]
    return len(labels) - 3, len(labels) - 2, len(labels) - 1


def _axis(places: Any, label: str, name: str) -> tuple[float | None, float, list[Notice]]:
    """Return the distance of the nodes along an axis and the place of the first, in mm, and what is told.

    Raises:
        UnsupportedFormatError: The axis is a time or an angle, or its nodes are not even.
    """
    unit = text_of(places.attrs.get("units", ""))
    if is_time(unit) or unit.strip().lower() in ANGLES or "angle" in label.lower():
        raise UnsupportedFormatError(
            f"{name}: the axis {label} in {unit or 'unknown units'} found among the last three; expected "
            "axes of space: projections are no slices; give the dataset of the reconstruction"
        )
    scale = length_of(unit)
    if scale is None:
        code, told = ("W-UNIT-UNKNOWN", f"unit {unit[:20]!r}") if unit else ("W-UNIT-MISSING", "no unit")
        sentence = f"the axis {label} has {told}; its places are not used; --spacing gives the lengths"
        return None, 0.0, [Notice(code, sentence)]
    check_inside(places, name)
    check_stored(places, places.file.id.get_filesize(), name, "copy it with h5repack")
    values = scale * np.asarray(places[()], np.float64)
    steps = np.diff(values)
    step = float(steps.mean())
    if not np.isfinite(values).all() or step == 0 or np.abs(steps - step).max() > UNEVEN * abs(step):
        raise UnsupportedFormatError(
            f"{name}: places along the axis {label} found that are not even; expected equal distances; "
            "resample the volume"
        )
    return step, float(values[0]), []
