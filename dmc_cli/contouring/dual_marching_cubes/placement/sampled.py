"""Place a polygon's vertex by sampling (`--placement sampled`; Grosso & Zint 2021, section 3.1.2).

Two coordinates run over the 7x7 interior points of a 9x9 lattice on the polygon's bounding box, the third
follows from the trilinear equation (equation 3) and has to lie in the box too. The sample nearest to the
mean of the polygon's crossings is the vertex. Without a sample a lattice of 25x25 points is tried, and last
the mean itself is taken, which is off the surface.

Where the paper leaves open or misprints what its authors' code does, this follows the code: the solved axis
is the one of the box's smallest extent, but for polygons of six or more edges the one of the largest gradient
component at the mean; ties go z, y, x; the solved coordinate must lie in the box, not only in the cell. The
second lattice is the paper's (25x25; the code has 26x26). The paper's test against the boxes of other
polygons of the cell never acts in the code, and is left out.
"""

import warp as wp

from dmc_cli.contouring.dual_marching_cubes.placement.exact import (
    COARSE_LATTICE,
    FINE_LATTICE,
    nearest_on_lattice,
)
from dmc_cli.field import CornerValues, EdgeSet, Polygon, measure_polygon, sum4, trilinear_gradient

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

MANY_EDGES = wp.constant(5.5)
"""Polygons with more edges (six or more) bend too much for their box to tell which way they face."""


@wp.func
def last_largest(sizes: wp.vec3) -> wp.int32:
    """Return the axis of the largest of three numbers; ties go z, y, x."""
    axis = int(2)
    if sizes[1] > sizes[2]:
        axis = 1
    if sizes[0] > sizes[axis]:
        axis = 0
    return axis


@wp.func
def solved_axis(f: CornerValues, polygon: Polygon) -> wp.int32:
    """Return the axis whose coordinate is solved for; the other two are sampled."""
    edge_count = sum4(polygon.edges.x) + sum4(polygon.edges.y) + sum4(polygon.edges.z)
    sizes = polygon.low - polygon.high
    if edge_count > MANY_EDGES:
        gradient = trilinear_gradient(f, polygon.mean)
        sizes = wp.vec3(wp.abs(gradient[0]), wp.abs(gradient[1]), wp.abs(gradient[2]))
    return last_largest(sizes)


@wp.func
def nearest_sample(f: CornerValues, polygon: Polygon, axis: wp.int32, points: wp.int32) -> wp.vec3:
    """Return the first of the samples nearest to the mean, of points x points in the box, or NOWHERE."""
    first = wp.where(axis == 0, 1, 0)
    second = wp.where(axis == 2, 1, 2)
    return nearest_on_lattice(f, polygon, axis, second, first, points)


@wp.func
def place_by_samples(f: CornerValues, edges: EdgeSet) -> wp.vec4:
    """Return a polygon's vertex in local coordinates, and 1 if it is the mean for want of a sample."""
    polygon = measure_polygon(f, edges)
    axis = solved_axis(f, polygon)
    p = nearest_sample(f, polygon, axis, COARSE_LATTICE)
    if p[0] < 0.0:
        p = nearest_sample(f, polygon, axis, FINE_LATTICE)
    is_mean = float(0.0)
    if p[0] < 0.0:
        p = polygon.mean
        is_mean = 1.0
    return wp.vec4(p[0], p[1], p[2], is_mean)
