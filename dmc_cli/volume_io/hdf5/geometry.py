"""Read what an HDF5 file says of a dataset's geometry: places along its axes, ITK's geometry, element sizes.

ITK keeps spacing, origin and directions beside the values, in mm, axes x, y, z, in LPS. `element_size_um`
(z, y, x) is what microscopists' programs write. Other attributes that look like lengths count where they have
a unit and are one length for all axes; else they are told.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.volume import Space
from dmc_cli.volume_io.axes import Axis, Image, stacked_image, unnamed_axes
from dmc_cli.volume_io.hdf5.dataset import ITK_VALUES, text_of
from dmc_cli.volume_io.hdf5.imaris import imaris_grid, is_imaris
from dmc_cli.volume_io.hdf5.named_axes import NamedAxes, named_axes, unit_of
from dmc_cli.volume_io.hdf_storage import check_inside, check_stored
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.units import length_of

LOOSE_LENGTHS = ("spacing", "resolution", "voxel_size", "voxel_spacing", "pixel_size", "pixelsize", "scale")
"""Attributes of lengths that no standard gives a unit."""

UNIT_SUFFIXES = ("", "_um", "_nm", "_mm")
"""Units that such an attribute may be called by."""

UNEVEN = 1e-3
"""A part of their mean by which distances of nodes may differ."""


@dataclass(frozen=True)
class HdfGeometry:
    """What a file says of a dataset.

    Attributes:
        image: Its axes.
        spacing: Distances along x, y, z in mm, or None where they are not told.
        origin: Place of the first node in mm, or None.
        directions: Shape (3, 3): columns are the axes x, y, z in the world.
        space: The world's axes.
        notices: What is not used.
    """

    image: Image
    spacing: Triple | None = None
    origin: Triple | None = None
    directions: Float64Array | None = None
    space: Space = "none"
    notices: tuple[Notice, ...] = ()


def hdf_geometry(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> HdfGeometry:
    """Return what a file says of a dataset's axes, itself or in the group that it is named in.

    Raises:
        UnsupportedFormatError: They are not those of a volume, or their nodes are not even.
    """
    if dataset.name == ITK_VALUES:
        return _itk(file, dataset, name)
    if is_imaris(file, dataset):
        nodes, lengths, first, doubts = imaris_grid(file, dataset, name)
        return HdfGeometry(stacked_image(nodes), lengths, first, notices=doubts)
    axes = named_axes(file, dataset, group, name, h5py)
    notices = (*unnamed_axes(axes.image), *_matlab(dataset))
    sizes = _numbers(dataset.attrs.get("element_size_um"))
    if len(sizes) == 3:
        z, y, x = (1e-3 * size for size in sizes)
        return HdfGeometry(axes.image, (x, y, z), notices=notices)
    spacing, origin, told = _placed(axes, name)
    if spacing is None and not told:
        spacing, told = _loose(dataset, file)
    return HdfGeometry(axes.image, spacing, origin, notices=(*notices, *told))


def _itk(file: Any, dataset: Any, name: str) -> HdfGeometry:
    """Return the geometry of an image that ITK wrote; a row of its directions is an axis.

    Of several values a node, the last axis counts them.
    """
    told = [file[f"/ITKImage/0/{key}"] for key in ("Spacing", "Origin", "Directions")]
    if [each.shape for each in told] != [(3,), (3,), (3, 3)]:
        raise ValueError("spacing, origin and directions of another shape than those of three axes")
    for each in told:
        check_inside(each, name)
        check_stored(each, file.id.get_filesize(), name, "copy it with h5repack")
    names = ("z", "y", "x", "channel")[: dataset.ndim]
    image = Image(tuple(Axis(label, int(n)) for label, n in zip(names, dataset.shape, strict=True)))
    x, y, z = (float(length) for length in told[0][()])
    i, j, k = (float(place) for place in told[1][()])
    directions = np.asarray(told[2][()], np.float64).T
    return HdfGeometry(image, (x, y, z), (i, j, k), directions, "LPS")


def _matlab(dataset: Any) -> tuple[Notice, ...]:
    """Return what is told of an array of MATLAB's, whose images are stored column by column."""
    if "MATLAB_class" not in dataset.attrs:
        return ()
    sentence = (
        "an array of MATLAB's names no axes; its first index is taken as x, which for images of MATLAB is y: "
        "the mesh may be mirrored"
    )
    return (Notice("W-AXES-MISSING", sentence),)


def _numbers(value: Any) -> list[float]:
    try:
        return [float(number) for number in np.atleast_1d(value)]
    except (TypeError, ValueError):
        return []


def _loose(dataset: Any, file: Any) -> tuple[Triple | None, tuple[Notice, ...]]:
    """Return the one length of all axes that attributes tell with its unit, in mm, or None and what is told.

    Attributes of the dataset count, else those of its group, else those of the file.
    """
    for owner in (dataset, dataset.parent, file):
        found = [
            (key + suffix, suffix[1:])
            for key in LOOSE_LENGTHS
            for suffix in UNIT_SUFFIXES
            if key + suffix in owner.attrs
        ]
        told = []
        for key, suffix in found:
            units = owner.attrs.get(f"{key}_unit", owner.attrs.get("units", owner.attrs.get("unit", "")))
            spelled = {suffix or text_of(unit) for unit in np.atleast_1d(units)}
            scale = length_of(spelled.pop()) if len(spelled) == 1 else None
            sizes = {*_numbers(owner.attrs[key])}
            if scale is not None and len(sizes) == 1:
                length = scale * sizes.pop()
                return (length, length, length), ()
            where = f"the attribute {key!r} of {owner.name}"
            if scale is None:
                sentence = f"{where} has no unit and is not used; --spacing gives lengths"
                told.append(Notice("W-UNIT-MISSING", sentence))
            else:
                sentence = f"{where} does not tell which axis its lengths are of; --spacing gives them"
                told.append(Notice("W-SPACING-MISSING", sentence))
        if told:
            return None, tuple(told)
    return None, ()


def _placed(axes: NamedAxes, name: str) -> tuple[Triple | None, Triple | None, tuple[Notice, ...]]:
    """Return distances and the first node's place along x, y, z in mm, None where they are not all told."""
    assert axes.image.grid is not None
    steps: list[float | None] = []
    first: list[float] = []
    notices: list[Notice] = []
    for axis in axes.image.grid:
        places = axes.places[axis]
        step, start, told = (None, 0.0, []) if places is None else _axis(places, axes.labels[axis], name)
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


def _axis(places: Any, label: str, name: str) -> tuple[float | None, float, list[Notice]]:
    """Return the distance of the nodes along an axis and the place of the first, in mm, and what is told.

    Raises:
        UnsupportedFormatError: Its nodes are not even.
    """
    unit = unit_of(places)
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
