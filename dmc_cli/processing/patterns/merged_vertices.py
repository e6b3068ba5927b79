"""Choose where the merged vertex of a 3-X-3-Y quad goes, and whether it may: the safe rules.

Names are those of `simplify_3x3y.py`. The papers put the vertex at the midpoint of X and Y and check nothing.
With `--project` it goes on to the surface. A point without a cell that exists, or from which the surface is
not found, gives way to the nearer of v1 and v2, which lie on the surface.
"""

import warp as wp

from dmc_cli.field import Field, Grid, GridPoint, cell_node, index_position, locate_point, project_point
from dmc_cli.mesh import next_in_quad, opposite_in_quad, previous_in_quad

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def merged_point(
    grid: Grid,
    field: Field,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    h: wp.int32,
    project: wp.bool,
) -> GridPoint:
    """Return where the merged vertex of the quad with cut h goes; `project` puts it on the surface."""
    x = corners[next_in_quad(h)]
    y = corners[previous_in_quad(h)]
    at_x = index_position(grid, cell[x], local[x])
    middle = wp.float64(0.5) * (at_x + index_position(grid, cell[y], local[y]))
    point = GridPoint()
    if project:
        point = project_point(field, grid, middle)
    else:
        point = locate_point(field, grid, middle)
    if point.is_found:
        return point
    v = corners[h]
    other = corners[opposite_in_quad(h)]
    near = wp.length_sq(index_position(grid, cell[v], local[v]) - middle)
    if wp.length_sq(index_position(grid, cell[other], local[other]) - middle) < near:
        v = other
    point.cell = cell_node(grid, cell[v])
    point.local = local[v]
    return point


@wp.func
def turns_over(
    corners: wp.array(dtype=wp.int32), position: wp.array(dtype=wp.vec3), h: wp.int32, target: wp.vec3
) -> wp.bool:
    """Return whether a quad's normal turns by 90 degrees or more if the origin of its halfedge h moves."""
    here = position[corners[h]]
    b = position[corners[next_in_quad(h)]]
    c = position[corners[opposite_in_quad(h)]]
    d = position[corners[previous_in_quad(h)]]
    before = wp.cross(c - here, d - b)
    return wp.dot(before, wp.cross(c - target, d - b)) <= 0.0 and wp.length_sq(before) > 0.0


@wp.func
def folds(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    h: wp.int32,
    target: wp.vec3,
) -> wp.bool:
    """Return whether the cut h would turn over one of the four neighbours, the merged vertex at `target`."""
    if turns_over(corners, position, next_in_quad(twin[h]), target):
        return True
    if turns_over(corners, position, twin[next_in_quad(h)], target):
        return True
    if turns_over(corners, position, next_in_quad(twin[opposite_in_quad(h)]), target):
        return True
    return turns_over(corners, position, twin[previous_in_quad(h)], target)
