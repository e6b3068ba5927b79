"""Move a mesh to a frame near its origin, in a unit near its spacing, while it is changed.

Shapes, areas and steps are reckoned in float32 from positions in the output space. Far from the origin
these are too coarse for that, and with a spacing of a millionth or a million of a millimetre powers of
lengths leave float32. Such a mesh is changed in a frame of its own; a vertex is its cell and local
coordinates, from which its position follows in any frame.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from dmc_cli.mesh.mesh import Mesh
from dmc_cli.mesh.placement import Placement

LEAST_SPACING, LARGEST_SPACING = 1e-6, 1e6
"""Between these the fourth power of a length, times another, is a float32 number."""

COARSE = 1e-3
"""Largest rounding of a position, in cells, that shapes are reckoned with."""

HALF_STEP = 2.0**-24
"""Largest rounding of a float32, as a share of the number."""


def in_near_frame(mesh: Mesh, placement: Placement) -> tuple[Mesh, Placement]:
    """Return the mesh itself where its positions can be reckoned with, else in a frame of its own."""
    linear, origin = placement.frame.affine[:3, :3], placement.frame.affine[:3, 3]
    spacing = np.linalg.norm(linear, axis=0)
    rounding = HALF_STEP * np.abs(np.linalg.inv(linear)) @ np.abs(origin)
    is_handy = LEAST_SPACING <= spacing.min() and spacing.max() <= LARGEST_SPACING
    if is_handy and rounding.max() <= COARSE:
        return mesh, placement
    near = np.eye(4)
    near[:3, :3] = linear if is_handy else np.ldexp(linear, -int(np.frexp(spacing.min())[1]))
    return in_frame_of(near, mesh, placement)


def in_frame_of(affine: np.ndarray[Any, Any], mesh: Mesh, placement: Placement) -> tuple[Mesh, Placement]:
    """Return a mesh in the frame that `affine` is the map to."""
    if placement.frame.affine is affine:
        return mesh, placement
    placement = placement.in_frame(affine)
    return replace(mesh, positions=placement.positions()), placement
