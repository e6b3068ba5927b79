"""Move a mesh to a frame near its origin, in a unit near its spacing, while it is changed.

Shapes, areas and steps are computed in float32 from positions in the output space. Far from the origin
these are too coarse for that, and with a spacing of a millionth or a million of a millimetre powers of
lengths overflow or underflow. Such a mesh is changed in a frame of its own; a vertex is its cell and local
coordinates, from which its position follows in any frame. Each stage does so itself; its caller sees the
frame that was given.
"""

from dataclasses import replace

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.mesh.mesh import Mesh
from dmc_cli.mesh.placement import Placement

LEAST_SPACING, LARGEST_SPACING = 1e-6, 1e6
"""Between these the fourth power of a length, times another, is a float32 number."""

COARSE = 1e-3
"""Largest rounding of a position, in cells, that shapes may be computed from."""

HALF_STEP = 2.0**-24
"""Largest rounding of a float32, as a share of the number."""


def in_near_frame(mesh: Mesh, placement: Placement) -> tuple[Mesh, Placement]:
    """Return the mesh itself where float32 positions are precise enough, else in a frame near the origin."""
    linear, origin = placement.frame.affine[:3, :3], placement.frame.affine[:3, 3]
    spacing = np.linalg.norm(linear, axis=0)
    rounding = HALF_STEP * np.abs(np.linalg.inv(linear)) @ np.abs(origin)
    has_fit_spacing = LEAST_SPACING <= spacing.min() and spacing.max() <= LARGEST_SPACING
    if has_fit_spacing and rounding.max() <= COARSE:
        return mesh, placement
    near = np.eye(4)
    near[:3, :3] = linear if has_fit_spacing else np.ldexp(linear, -int(np.frexp(spacing.min())[1]))
    if np.array_equal(near, placement.frame.affine):  # it is near already
        return mesh, placement
    return in_frame_of(near, mesh, placement)


def in_frame_of(affine: Float64Array, mesh: Mesh, placement: Placement) -> tuple[Mesh, Placement]:
    """Return a mesh with positions in the frame that `affine`, shape (4, 4), maps node indices to."""
    if placement.frame.affine is affine:
        return mesh, placement
    placement = placement.in_frame(affine)
    return replace(mesh, positions=placement.positions()), placement
