"""Measure how far meshes are from each other and from the surface that they were cut from."""

import numpy as np
import warp as wp
from scipy.spatial import cKDTree

from dmc_cli.field.field import cell_values
from dmc_cli.field.projection import point_at
from dmc_cli.field.trilinear import single_precision, trilinear_value
from dmc_cli.processing.tangent_step import SurfaceContext, make_context


def index_positions(surface):
    """Where the vertices are, in node indices."""
    cell, grid = surface.placement.cell.numpy(), surface.placement.frame.grid
    nodes = np.stack([cell % grid.nx, cell // grid.nx % grid.ny, cell // (grid.nx * grid.ny)], axis=1)
    return nodes + surface.placement.local.numpy().astype(float)


def points_of(corners, count):
    """Points spread evenly over bilinear quads, `count` along each side, as (quads, count^2, 3)."""
    u, v = (x.ravel()[None, :, None] for x in np.meshgrid(*[np.linspace(0, 1, count)] * 2))
    a, b, c, d = corners.transpose(1, 0, 2)[:, :, None, :]
    return (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d


def farthest_vertex(old, new):
    """The largest distance in cells of an old vertex from the new quads, at points spread over these."""
    corners, vertices = index_positions(new)[new.mesh.faces.numpy()], index_positions(old)
    found = cKDTree(points_of(corners, 5).reshape(-1, 3)).query(vertices)[0]
    centres = cKDTree(corners.mean(axis=1))
    for n in np.flatnonzero(found > 0.8):
        near = centres.query(vertices[n], k=min(24, len(corners)))[1]
        gaps = points_of(corners[np.atleast_1d(near)], 17) - vertices[n]
        found[n] = min(found[n], np.linalg.norm(gaps, axis=2).min())
    return found.max(initial=0)


def high_quads(surface):
    """How many quads' centres are more than half a cell from the surface.

    The interpolant is continuous: between a centre and a point with a value of another sign is the surface.
    """
    centres = index_positions(surface)[surface.mesh.faces.numpy()].mean(axis=1)
    device = surface.mesh.device
    distance = device.empty(len(centres), wp.float32)
    inputs = [make_context(surface.placement.frame), wp.array(centres, dtype=wp.vec3d, device=device.name)]
    device.launch(distances_kernel, len(centres), inputs, [distance])
    return int((distance.numpy() > 0.5).sum())


@wp.func
def value_at(context: SurfaceContext, x: wp.vec3d) -> wp.float32:
    point = point_at(context.grid, x)
    f = single_precision(
        cell_values(context.field, context.grid, point.cell[0], point.cell[1], point.cell[2])
    )
    return trilinear_value(f, point.local[0], point.local[1], point.local[2])


@wp.kernel
def distances_kernel(
    first: wp.int32,
    context: SurfaceContext,
    point: wp.array(dtype=wp.vec3d),
    distance_out: wp.array(dtype=wp.float32),
):
    n = first + wp.tid()
    here = value_at(context, point[n])
    best = wp.where(here == 0.0, 0.0, 9.0)
    for reach in range(1, 11):
        side = wp.where(best < 9.0, 0, 2 * reach + 1)
        for m in range(side * side * side):
            i = wp.vec3i(m % side - reach, m / side % side - reach, m / (side * side) - reach)
            if wp.max(wp.abs(i[0]), wp.max(wp.abs(i[1]), wp.abs(i[2]))) == reach:
                way = wp.vec3d(wp.float64(i[0]), wp.float64(i[1]), wp.float64(i[2])) * wp.float64(0.05)
                length = wp.float32(wp.length(way))
                is_across = here * value_at(context, point[n] + way) <= 0.0
                if is_across and length <= 0.5:
                    best = wp.min(best, length)
    distance_out[n] = best
