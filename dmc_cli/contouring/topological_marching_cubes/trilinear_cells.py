"""Triangulate special cells as the trilinear interpolant's surface has it (Grosso 2016, 2017).

The faces are decided by the asymptotic decider and the polygons traced. Inside, the surface holds up to six
straight lines along the axes, the sides of a hexagon: an axis' two roots are where the cut across it falls
into two lines. Where the whole hexagon lies in the cell, two polygons are joined to it, a tunnel, or the one
polygon there is, a disc. Where some of its sides cross, an inner vertex in the middle of them is fanned. All
else is as by the polygons alone.

A polygon finds its way round the hexagon by where the sides' lines meet the cell's faces: the lines lie in
the surface, so these points lie on the polygons, and each tells which two vertices of the hexagon follow each
other there. No distance is compared.

Ties: the surface is that of the isovalue less an infinitesimal, so that equality joins inside corners. Which
roots lie in the cell follows from signs; a number that is zero has the sign of what an infinitesimal adds.
The discriminant is computed with twice the digits of a double, exact for values of up to 16 bits.
"""

import warp as wp

from dmc_cli.contouring.stages.cell_edges import EdgeVertices12, edge_vertices_of
from dmc_cli.contouring.stages.cell_triangles import Tables
from dmc_cli.contouring.stages.cell_words import cell_case
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.contouring.stages.face_decisions import are_inside_joined
from dmc_cli.contouring.stages.special_list import own_ambiguous_faces
from dmc_cli.contouring.stages.tracing import is_ambiguous
from dmc_cli.field import (
    CornerValues64,
    Field,
    Grid,
    cell_values,
    node_cell,
    node_position,
    row_place,
    slice_distance,
    world_position,
)
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

POLYGONS, SEVERAL, FACES, TUNNELS = wp.constant(0), wp.constant(1), wp.constant(2), wp.constant(3)
TALLIES = 4
"""What is counted of each special cell, the rows of an array: its polygons; 1 if it has several; its
ambiguous faces that no lower cell shares; 1 if it has a tunnel."""


CellCounts = wp.types.vector(length=4, dtype=wp.int32)
"""Triangles, inner vertices, polygons and tunnels of a cell."""


@wp.func_native(native(__file__, "triangulate_cell"))
def triangulate_cell(
    corner_values: CornerValues64,
    corners: wp.int32,
    joined: wp.int32,
    frame: wp.array(dtype=wp.float32),
    step: wp.float32,
    is_best: wp.int32,
    is_reversed: wp.int32,
    vertices: EdgeVertices12,
    first_inner: wp.int32,
    first_triangle: wp.int32,
    faces_out: wp.array(dtype=wp.vec4i),
    local_out: wp.array(dtype=wp.vec3),
) -> CellCounts:
    """Count what a cell has, and write down its triangles and inner vertices.

    Nothing is written where `first_triangle` is below 0. `corners` is the case, `joined` has a bit for each
    face, `frame` is that of `Tables`, `step` tells how far the slices are apart.
    """
    ...


@wp.func
def joined_faces(f: CornerValues64, case: wp.int32) -> wp.int32:
    """Return a bit for each ambiguous face of a cell: whether its inside corners are joined."""
    joined = int(0)
    for face in range(6):
        if is_ambiguous(case, face):
            if are_inside_joined(f, case, face):
                joined |= 1 << face
    return joined


@wp.kernel
def count_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    bits: EdgeBits,
    inside: wp.array2d(dtype=wp.uint32),
    rows: wp.array(dtype=wp.int32),
    nodes: wp.array(dtype=wp.int32),
    tables: Tables,
    depths: wp.array(dtype=wp.float64),
    is_best: wp.int32,
    no_faces: wp.array(dtype=wp.vec4i),
    no_points: wp.array(dtype=wp.vec3),
    # Out:
    counts_out: wp.array2d(dtype=wp.int64),
    tallies_out: wp.array2d(dtype=wp.uint8),
) -> None:
    """Count the triangles and inner vertices of a special cell. One thread per special cell."""
    s = first + wp.tid()
    row = rows[s]
    i = nodes[s]
    place = row_place(grid, row)
    case = cell_case(grid, inside, row, i)
    f = cell_values(field, grid, i, place[0], place[1])
    found = triangulate_cell(
        f,
        case,
        joined_faces(f, case),
        tables.frame,
        wp.float32(slice_distance(depths, place[1])),
        is_best,
        0,
        EdgeVertices12(),
        0,
        -1,
        no_faces,
        no_points,
    )
    counts_out[0, s] = wp.int64(found[0])
    counts_out[1, s] = wp.int64(found[1])
    tallies_out[POLYGONS, s] = wp.uint8(found[2])
    tallies_out[SEVERAL, s] = wp.uint8(wp.where(found[2] > 1, 1, 0))
    tallies_out[FACES, s] = wp.uint8(own_ambiguous_faces(grid, bits, case, row, i))
    tallies_out[TUNNELS, s] = wp.uint8(found[3])


@wp.kernel
def connect_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    bits: EdgeBits,
    inside: wp.array2d(dtype=wp.uint32),
    rows: wp.array(dtype=wp.int32),
    nodes: wp.array(dtype=wp.int32),
    tables: Tables,
    depths: wp.array(dtype=wp.float64),
    is_best: wp.int32,
    is_reversed: wp.int32,
    matrix: wp.mat44d,
    triangle_starts: wp.array(dtype=wp.int64),
    inner_starts: wp.array(dtype=wp.int64),
    first_triangle: wp.int32,
    first_inner: wp.int32,
    # Out:
    faces_out: wp.array(dtype=wp.vec4i),
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
) -> None:
    """Connect the triangles of a special cell, and place its inner vertices. One thread per special cell."""
    s = first + wp.tid()
    row = rows[s]
    i = nodes[s]
    place = row_place(grid, row)
    case = cell_case(grid, inside, row, i)
    f = cell_values(field, grid, i, place[0], place[1])
    v = first_inner + wp.int32(inner_starts[s])
    found = triangulate_cell(
        f,
        case,
        joined_faces(f, case),
        tables.frame,
        wp.float32(slice_distance(depths, place[1])),
        is_best,
        is_reversed,
        edge_vertices_of(grid, bits, row, i),
        v,
        first_triangle + wp.int32(triangle_starts[s]),
        faces_out,
        local_out,
    )
    node = wp.vec3i(i, place[0], place[1])
    for n in range(found[1]):
        cell_out[v + n] = node_cell(grid, node)
        position_out[v + n] = world_position(matrix, node_position(node, local_out[v + n]))
