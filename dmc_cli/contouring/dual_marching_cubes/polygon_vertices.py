"""Number the vertices of polygons: none for a polygon without a quad, one a fan of quads.

Edges of an open border, or beside a cell that does not exist, have no quad. So a polygon there may end up
without any, and gives no vertex; or its quads form several fans. With manifold topology each fan then gets a
vertex of its own, all at one place.
"""

import warp as wp

from dmc_cli.bits import has_bit
from dmc_cli.contouring.dual_marching_cubes.special_cells import MULTI, POLYGONS, UNUSED, is_active
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.tracing import (
    EDGE_HIGH,
    EDGE_LOW,
    FACE_EDGE_BITS,
    NO_OWNER,
    NO_OWNERS,
    edges_owned,
    has_several,
    next_edge,
    owner_of,
    with_owner,
)
from dmc_cli.field import ALL_EDGES, Grid, row_place

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def edge_has_quad(
    grid: Grid, bits: CellBits, i: wp.int32, j: wp.int32, k: wp.int32, edge: wp.int32
) -> wp.bool:
    """Return whether a crossed edge of cell (i, j, k) has a quad: the three cells beside it exist."""
    corner = EDGE_LOW[edge]
    axis = EDGE_HIGH[edge] - corner  # 1, 2, 4 for x, y, z
    di = 2 * (corner & 1) - 1
    dj = 2 * ((corner >> 1) & 1) - 1
    dk = 2 * (corner >> 2) - 1
    found = bool(False)
    if axis == 1:
        found = is_active(grid, bits, i, j + dj, k) and is_active(grid, bits, i, j, k + dk)
        found = found and is_active(grid, bits, i, j + dj, k + dk)
    elif axis == 2:
        found = is_active(grid, bits, i + di, j, k) and is_active(grid, bits, i, j, k + dk)
        found = found and is_active(grid, bits, i + di, j, k + dk)
    else:
        found = is_active(grid, bits, i + di, j, k) and is_active(grid, bits, i, j + dj, k)
        found = found and is_active(grid, bits, i + di, j + dj, k)
    return found


@wp.func
def edges_with_quad(
    grid: Grid, bits: CellBits, i: wp.int32, j: wp.int32, k: wp.int32, crossed: wp.uint32
) -> wp.uint32:
    """Return a bit for each crossed edge of cell (i, j, k) that has a quad."""
    found = wp.uint32(0)
    for edge in range(12):
        if has_bit(crossed, edge) and edge_has_quad(grid, bits, i, j, k, edge):
            found |= wp.uint32(1) << wp.uint32(edge)
    return found


@wp.func
def border_edges(grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.uint32:
    """Return a bit for each edge of cell (i, j, k) that lies in a face of the grid, and so has no quad."""
    edges = int(0)
    edges |= wp.where(i == 0, FACE_EDGE_BITS[0], 0) | wp.where(i == grid.nx - 2, FACE_EDGE_BITS[1], 0)
    edges |= wp.where(j == 0, FACE_EDGE_BITS[2], 0) | wp.where(j == grid.ny - 2, FACE_EDGE_BITS[3], 0)
    edges |= wp.where(k == 0, FACE_EDGE_BITS[4], 0) | wp.where(k == grid.nz - 2, FACE_EDGE_BITS[5], 0)
    return wp.uint32(edges)


@wp.func
def assign_fans(
    case: wp.int32,
    joined: wp.uint32,
    owners: wp.uint64,
    start: wp.int32,
    with_quad: wp.uint32,
    owner: wp.int32,
) -> wp.uint64:
    """Give each run of edges with quads round the polygon of edge `start` its own owner.

    `start` has no quad; the owners count up from `owner`.
    """
    result = with_owner(owners, start, NO_OWNER)
    current = int(owner - 1)
    previous = int(-1)
    edge = int(start)
    following = next_edge(case, joined, previous, edge)
    while following != start:
        if has_bit(with_quad, following):
            if not has_bit(with_quad, edge):
                current += 1
            result = with_owner(result, following, current)
        else:
            result = with_owner(result, following, NO_OWNER)
        previous = edge
        edge = following
        following = next_edge(case, joined, previous, edge)
    return result


@wp.struct
class CellVertices:
    """The vertices of a cell: each edge's, and how many; how many polygons, and how many without a vertex."""

    owners: wp.uint64
    count: wp.int32
    polygons: wp.int32
    unused: wp.int32


@wp.func
def number_fans(
    case: wp.int32,
    joined: wp.uint32,
    owners: wp.uint64,
    polygons: wp.int32,
    with_quad: wp.uint32,
    splits_fans: wp.bool,
) -> CellVertices:
    """Return the vertices of a cell with edges that have no quad."""
    found = CellVertices()
    found.owners = NO_OWNERS
    found.polygons = polygons
    for polygon in range(polygons):
        bare = int(-1)  # an edge without a quad, if there is one
        quads = int(0)
        for edge in range(12):
            if owner_of(owners, edge) == polygon:
                if has_bit(with_quad, edge):
                    quads += 1
                    found.owners = with_owner(found.owners, edge, found.count)
                else:
                    bare = edge
        if quads == 0:
            found.unused += 1
        elif bare >= 0 and splits_fans:
            found.owners = assign_fans(case, joined, found.owners, bare, with_quad, found.count)
            for edge in range(12):
                owner = owner_of(found.owners, edge)
                if owner != NO_OWNER:
                    found.count = wp.max(found.count, owner + 1)
        else:
            found.count += 1
    return found


@wp.func
def number_vertices(
    grid: Grid,
    bits: CellBits,
    row: wp.int32,
    i: wp.int32,
    case: wp.int32,
    joined: wp.uint32,
    owners: wp.uint64,
    splits_fans: wp.bool,
    has_nodata: wp.int32,
) -> CellVertices:
    """Turn the polygons of a special cell into vertices: none for a polygon without quads, one a fan."""
    place = row_place(grid, row)
    j = place[0]
    k = place[1]
    crossed = wp.uint32(ALL_EDGES) & ~edges_owned(owners, NO_OWNER)
    bare = crossed & border_edges(grid, i, j, k)
    if has_nodata == 1:
        bare = crossed & ~edges_with_quad(grid, bits, i, j, k, crossed)
    polygons = int(1)
    if has_several(owners):
        for edge in range(12):
            polygons = wp.max(polygons, (owner_of(owners, edge) + 1) & NO_OWNER)
    found = CellVertices()
    found.owners = owners
    found.count = polygons
    found.polygons = polygons
    if polygons == 1 and has_nodata == 0 and wp.bit_count(bare) == 2:  # one segment in one face: one fan
        for edge in range(12):
            if has_bit(bare, edge):
                found.owners = with_owner(found.owners, edge, NO_OWNER)
    elif bare != wp.uint32(0):
        found = number_fans(case, joined, owners, polygons, crossed & ~bare, splits_fans)
    return found


@wp.func
def store_vertices(
    found: CellVertices,
    s: wp.int32,
    owners_out: wp.array(dtype=wp.uint64),
    count_out: wp.array(dtype=wp.int64),
    tallies_out: wp.array2d(dtype=wp.uint8),
) -> None:
    """Write down the vertices of special cell s."""
    owners_out[s] = found.owners
    count_out[s] = wp.int64(found.count)
    tallies_out[POLYGONS, s] = wp.uint8(found.polygons)
    tallies_out[UNUSED, s] = wp.uint8(found.unused)
    tallies_out[MULTI, s] = wp.uint8(wp.where(found.polygons > 1, 1, 0))
