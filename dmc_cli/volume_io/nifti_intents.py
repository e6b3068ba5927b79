"""Tell what the fourth and fifth axis of a NIfTI file count, by its intent: times, or the parts of a value.

Source: nifti1.h. Parts of a value lie along dim[5]; FSL and others put them along dim[4], which is no time
then. A symmetric matrix has its lower triangle, row by row.
"""

from collections.abc import Sequence
from typing import Any

from dmc_cli.volume_io.axes import Axis

AXES = ("x", "y", "z", "time", "component", "axis 6", "axis 7")
"""What dim counts, in its order, where the intent says nothing else."""

_PLACE = ("x", "y", "z")
_COLOURS = ("red", "green", "blue", "alpha")
_SYMMETRIC = ("xx", "xy", "yy", "xz", "yz", "zz")

PARTS: dict[int, tuple[str, tuple[str, ...]]] = {
    1004: ("matrix entry", ()),
    1005: ("symmetric matrix entry", _SYMMETRIC),
    1006: ("displacement", _PLACE),
    1007: ("vector component", _PLACE),
    1008: ("point coordinate", _PLACE),
    1009: ("triangle corner", ()),
    1010: ("quaternion component", ("w", "x", "y", "z")),
    2003: ("colour", _COLOURS),
    2004: ("colour", _COLOURS),
    2006: ("displacement", _PLACE),
    2007: ("spline coefficient", _PLACE),
    2008: ("cosine coefficient", _PLACE),
    2009: ("spline coefficient", _PLACE),
}
"""Code of an intent (those from 2006 are FSL's) to what a part of a value is called, and each one's name."""


def named_axes(header: Any, sizes: Sequence[int]) -> list[Axis]:
    """Return the axes of dim, x first.

    Args:
        header: One of nibabel's.
        sizes: What dim counts, in its order.
    """
    axes = [Axis(label, size) for label, size in zip(AXES, sizes, strict=False)]
    found = PARTS.get(int(header["intent_code"]))
    along = next((number for number in (4, 3) if len(sizes) > number and sizes[number] > 1), None)
    if found is None or along is None:
        return axes
    what, names = found
    size = sizes[along]
    if len(names) < size or (names == _SYMMETRIC and size != len(names)):
        names = ()
    axes[along] = Axis(what, size, _with_title(names, size, header))
    return axes


def _with_title(names: Sequence[str], size: int, header: Any) -> tuple[str, ...]:
    """Return the names of parts, each with what the header calls the whole, if it does."""
    title = bytes(header["intent_name"].item()).decode("utf-8", "replace").strip("\0 ")
    labels = [*names[:size], *[""] * (size - len(names))]
    return tuple(", ".join(part for part in (label, title) if part) for label in labels)
