"""Move a vertex along the trilinear surface: device functions for stages that do so.

A step is given in the output space. It is taken in the grid, and from where it leads the vertex is put back
on the surface by `project_point`. Unevenly spaced slices are counted in.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.field import (
    Field,
    Grid,
    GridPoint,
    cell_node,
    cell_values,
    index_position,
    kernel_matrix,
    node_cell,
    project_point,
    single_precision,
    slice_distance,
    trilinear_gradient,
)
from dmc_cli.mesh import SurfaceFrame

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LONGEST_STEP = wp.constant(0.4)
LONGEST_MOVE = wp.constant(wp.float64(0.5))
"""In cells along each axis, before and after the way back to the surface: further off the tangent plane says
little of it."""

LEAST_SIZE, LARGEST_SIZE = wp.constant(2.0**-63), wp.constant(2.0**63)
"""Of a vector whose square float32 holds with all its digits."""


@wp.struct
class SurfaceContext:
    """What the surface is made of, and the maps between its grid and the output space."""

    field: Field
    grid: Grid
    depths: wp.array(dtype=wp.float64)
    to_output: wp.mat44d
    to_grid: wp.mat33
    normal_to_output: wp.mat33


def make_context(frame: SurfaceFrame) -> Any:
    """Return the kernels' view of a frame."""
    context = SurfaceContext()
    inverse = np.linalg.inv(frame.affine[:3, :3])
    context.field, context.grid = frame.field, frame.grid.struct()
    context.depths = frame.depths
    context.to_output = kernel_matrix(frame.affine)
    context.to_grid = wp.mat33(*inverse.ravel())
    context.normal_to_output = wp.mat33(*inverse.T.ravel())
    return context


@wp.func
def surface_normal(context: SurfaceContext, cell: wp.vec3i, local: wp.vec3) -> wp.vec3:
    """Return the unit normal of the surface in the output space, along the gradient of F, or 0."""
    f = single_precision(cell_values(context.field, context.grid, cell[0], cell[1], cell[2]))
    gradient = trilinear_gradient(f, local)
    gradient[2] = gradient[2] / wp.float32(slice_distance(context.depths, cell[2]))
    normal = context.normal_to_output * gradient
    size = wp.max(wp.abs(normal))
    if size > 0.0 and (size < LEAST_SIZE or size > LARGEST_SIZE):
        normal = normal / size
    return wp.normalize(normal)


@wp.func
def glide(context: SurfaceContext, cell: wp.int64, local: wp.vec3, step: wp.vec3) -> GridPoint:
    """Return the point on the surface after a step in the output space from a vertex, if it is found."""
    way = context.to_grid * step
    way[2] = way[2] / wp.float32(slice_distance(context.depths, cell_node(context.grid, cell)[2]))
    longest = wp.max(wp.abs(way))
    if longest > LONGEST_STEP:
        way *= LONGEST_STEP / longest
    start = index_position(context.grid, cell, local)
    end = project_point(context.field, context.grid, start + wp.vec3d(way))
    if end.is_found:
        moved = index_position(context.grid, node_cell(context.grid, end.cell), end.local) - start
        end.is_found = wp.max(wp.abs(moved)) <= LONGEST_MOVE
    return end
