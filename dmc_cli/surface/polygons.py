"""MC polygons of the special cells, traced from the face segments; no table of cases.

The surface crosses a cell face in segments that join its crossed edges. An ambiguous face (diagonal
corners inside) is decided by the asymptotic decider in its product form: the inside corners are joined
if the product of their distances to the isovalue is at least that of the outside corners' (in double
precision; equivalent to the sign of the face's saddle value, but without its quotient). The decision
does not depend on the order of the corners, so both cells of the face agree. Following the segments from
edge to edge closes the polygons (Grosso & Zint 2021, section 3.1.1).

`--topology manifold` then flips the decision of each face whose two segments lie in one polygon in both
of its cells: there the dual mesh would have an edge with four quads. One sweep over six classes of faces
(x even, x odd, y even, y odd, z even, z odd; index of the face along its axis) suffices: a flip splits a
polygon in each cell, never merges any, and no two faces of a class share a cell.

A polygon becomes one vertex. Edges of an open border have no quad, so a polygon there may end up without
any (it gives no vertex) or with several fans of quads (with manifold topology: one vertex a fan).
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.device import Device
from dmc_cli.surface.cells import CellBits, Cells
from dmc_cli.surface.field import Field, node_value
from dmc_cli.surface.grid import CORNERS, EDGES, Grid, GridShape, bit_index, has_bit

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

AMBIGUOUS = wp.uint32(1 << 8)
"""The first of the bits of `SpecialCells.joined` that say which faces are ambiguous."""

NO_LABEL = 15
"""Label of an edge that belongs to no polygon, or to no vertex."""

NO_LABELS = wp.uint64(0xFFFFFFFFFFFF)
"""Twelve times `NO_LABEL`."""


def _face_corners() -> list[int]:
    """Return the corners of each face, in the order low-low, high-low, low-high, high-high of its axes."""
    corners = []
    for axis in range(3):
        for side in range(2):
            corners += [c for c in range(8) if CORNERS[c][axis] == side]
    return corners


def _face_edges() -> list[int]:
    """Return the edges of each face f0 f1 f2 f3 (as `_face_corners`), in the order f0f1 f1f3 f2f3 f0f2."""
    corners = _face_corners()
    edges = []
    for face in range(6):
        f = corners[4 * face : 4 * face + 4]
        for a, b in ((0, 1), (1, 3), (2, 3), (0, 2)):
            edges.append(EDGES.index((f[a], f[b])))
    return edges


def _edge_places() -> list[int]:
    """Return the two places of each edge among `_face_edges`: place 4f + s is side s of face f."""
    edges = _face_edges()
    return [place for edge in range(12) for place in range(24) if edges[place] == edge]


def _bits(members: list[int]) -> int:
    """Return a number with a bit for each member."""
    return sum(1 << member for member in members)


Vec6 = wp.types.vector(length=6, dtype=wp.int32)
Vec24 = wp.types.vector(length=24, dtype=wp.int32)
Vec12 = wp.types.vector(length=12, dtype=wp.int32)

_CORNERS = _face_corners()

FACE_MASKS = wp.constant(Vec6(*[_bits(_CORNERS[4 * face : 4 * face + 4]) for face in range(6)]))
FACE_DIAGONALS = wp.constant(Vec6(*[_bits(_CORNERS[4 * face : 4 * face + 4 : 3]) for face in range(6)]))
"""The corners of each face, and the diagonal f0 f3 of it, as cases."""

_EDGES = _face_edges()

FACE_EDGE_BITS = wp.constant(Vec6(*[_bits(_EDGES[4 * face : 4 * face + 4]) for face in range(6)]))
"""The edges of each face, a bit each."""

FACE_CORNERS = wp.constant(Vec24(*_face_corners()))
FACE_EDGES = wp.constant(Vec24(*_face_edges()))
EDGE_PLACES = wp.constant(Vec24(*_edge_places()))
EDGE_LOW = wp.constant(Vec12(*[a for a, _ in EDGES]))
EDGE_HIGH = wp.constant(Vec12(*[b for _, b in EDGES]))


@wp.struct
class SpecialCells:
    """The special cells in grid order; each row's lie at `starts[row]` to `starts[row + 1]`.

    `joined` has a bit a face: inside corners joined; eight bits up, a bit a face: it is ambiguous. `polygons` has four bits an edge: the number of its
    polygon among the cell's, or `NO_LABEL`; `vertices` likewise the number of its vertex among the cell's.
    `first_vertex` counts the vertices of the special cells before.
    """

    starts: wp.array(dtype=wp.int64)
    row: wp.array(dtype=wp.int32)
    i: wp.array(dtype=wp.int32)
    joined: wp.array(dtype=wp.uint32)
    polygons: wp.array(dtype=wp.uint64)
    vertices: wp.array(dtype=wp.uint64)
    first_vertex: wp.array(dtype=wp.int64)


@dataclass(frozen=True)
class Polygons:
    """MC polygons of the special cells, and what was counted on the way.

    Attributes:
        special: The kernels' `SpecialCells`.
        special_count: Number of special cells.
        vertex_count: Number of vertices of all cells.
        polygon_count: Number of polygons of all cells, those without a vertex included.
        unused_count: Polygons without a quad, hence without a vertex.
        multi_polygon_cells: Cells with more than one polygon.
        ambiguous_faces: Faces with diagonal corners inside, each counted once.
        flipped_faces: Faces whose decision was flipped.
    """

    special: Any
    special_count: int
    vertex_count: int
    polygon_count: int
    unused_count: int
    multi_polygon_cells: int
    ambiguous_faces: int
    flipped_faces: int


def trace_polygons(cells: Cells, field: Any, grid: GridShape, manifold: bool, device: Device) -> Polygons:
    """Trace the polygons of the special cells and number all vertices: ordinary cells' first.

    Args:
        cells: Active cells.
        field: The `Field` whose zero set is the surface.
        grid: The grid over the volume.
        manifold: Flip faces until the mesh is manifold, and give each fan its own vertex.
        device: Where to work.
    """
    count = cells.special_count
    special = SpecialCells()
    special.starts = cells.special_starts
    special.row, special.i = device.empty(count, wp.int32), device.empty(count, wp.int32)
    special.joined = device.empty(count, wp.uint32)
    special.polygons, special.vertices = device.empty(count, wp.uint64), device.empty(count, wp.uint64)
    struct = grid.struct()
    device.launch(
        list_special_cells_kernel,
        grid.rows,
        [struct, cells.bits, cells.special_starts],
        [special.row, special.i],
    )
    ambiguous = device.empty(count, wp.int64)
    device.launch(
        decide_faces_kernel, count, [struct, cells.bits, field, special], [special.joined, ambiguous]
    )
    device.launch(trace_kernel, count, [struct, cells.bits, special], [special.polygons])
    flipped_faces = _flip_faces(cells, special, count, struct, device) if manifold else 0
    polygons, vertices, unused, multi = (device.empty(count, wp.int64) for _ in range(4))
    device.launch(
        number_vertices_kernel,
        count,
        [struct, cells.bits, special, manifold, field.has_absent],
        [special.vertices, polygons, vertices, unused, multi],
    )
    special.first_vertex, vertex_count = device.starts(vertices)
    return Polygons(
        special=special,
        special_count=count,
        vertex_count=cells.ordinary_count + vertex_count,
        polygon_count=cells.ordinary_count + device.total(polygons),
        unused_count=device.total(unused),
        multi_polygon_cells=device.total(multi),
        ambiguous_faces=device.total(ambiguous),
        flipped_faces=flipped_faces,
    )


def _flip_faces(cells: Cells, special: Any, count: int, struct: Any, device: Device) -> int:
    """Flip the faces that make non-manifold edges; return their number."""
    flips = device.zeros(count, wp.int64)
    for axis in range(3):
        for parity in range(2):
            inputs = [struct, cells.bits, special, axis, parity]
            device.launch(flip_faces_kernel, count, inputs, [special.joined, special.polygons, flips])
    return device.total(flips)


@wp.func
def cell_case(grid: Grid, inside: wp.array2d(dtype=wp.uint32), row: wp.int32, i: wp.int32) -> wp.int32:
    """Return a cell's case: bit c is set if corner c is inside."""
    w = i // 32
    b = i % 32
    w1 = (i + 1) // 32
    b1 = (i + 1) % 32
    case = int(0)
    for r in range(4):
        corner_row = row + (r & 1) + (r >> 1) * grid.ny
        if has_bit(inside[corner_row, w], b):
            case |= 1 << (2 * r)
        if has_bit(inside[corner_row, w1], b1):
            case |= 2 << (2 * r)
    return case


@wp.func
def is_crossed(case: wp.int32, edge: wp.int32) -> wp.bool:
    """Return whether an edge has one end inside."""
    return ((case >> EDGE_LOW[edge]) & 1) != ((case >> EDGE_HIGH[edge]) & 1)


@wp.func
def is_ambiguous(case: wp.int32, face: wp.int32) -> wp.bool:
    """Return whether a face has two diagonal corners inside and two outside."""
    corners = case & FACE_MASKS[face]
    return corners == FACE_DIAGONALS[face] or corners == (FACE_MASKS[face] ^ FACE_DIAGONALS[face])


@wp.func
def segment_partner(case: wp.int32, joined: wp.uint32, face: wp.int32, side: wp.int32) -> wp.int32:
    """Return the side (0 to 3) where the segment from a crossed side of a face ends.

    Sides in the order f0f1 f1f3 f2f3 f0f2 run round the face; f1 lies between sides 0 and 1, f3 between
    1 and 2, f2 between 2 and 3, f0 between 3 and 0. On an ambiguous face a segment cuts off one corner: an
    outside one if the inside corners are joined.
    """
    partner = side
    if is_ambiguous(case, face):
        first_inside = ((case >> FACE_CORNERS[4 * face]) & 1) == 1
        join = has_bit(joined, face)
        if first_inside == join:
            partner = side ^ 1  # cuts off f1 and f2
        else:
            partner = 3 - side  # cuts off f0 and f3
    else:
        for other in range(4):
            if other != side and is_crossed(case, FACE_EDGES[4 * face + other]):
                partner = other
    return partner


@wp.func
def label_of(labels: wp.uint64, edge: wp.int32) -> wp.int32:
    """Return the label of an edge."""
    return wp.int32((labels >> wp.uint64(4 * edge)) & wp.uint64(15))


@wp.func
def with_label(labels: wp.uint64, edge: wp.int32, label: wp.int32) -> wp.uint64:
    """Return labels with that of one edge replaced."""
    shift = wp.uint64(4 * edge)
    return (labels & ~(wp.uint64(15) << shift)) | (wp.uint64(label) << shift)


@wp.func
def next_edge(case: wp.int32, joined: wp.uint32, previous: wp.int32, edge: wp.int32) -> wp.int32:
    """Return the edge that follows `edge` round its polygon; `previous` is the one before, or -1."""
    place = EDGE_PLACES[2 * edge]
    following = FACE_EDGES[place - place % 4 + segment_partner(case, joined, place / 4, place % 4)]
    if following == previous:
        place = EDGE_PLACES[2 * edge + 1]
        following = FACE_EDGES[place - place % 4 + segment_partner(case, joined, place / 4, place % 4)]
    return following


@wp.func
def is_split(case: wp.int32) -> wp.bool:
    """Return whether a cell may have several polygons: an ambiguous face, or two lone opposite corners."""
    lone = case == 0x81 or case == 0x42 or case == 0x24 or case == 0x18
    outside = 255 - case
    lone = lone or outside == 0x81 or outside == 0x42 or outside == 0x24 or outside == 0x18
    for face in range(6):
        lone = lone or is_ambiguous(case, face)
    return lone


@wp.func
def trace_cell(case: wp.int32, joined: wp.uint32) -> wp.uint64:
    """Return the label of each edge: the number of its polygon, in the order of their lowest edges."""
    labels = NO_LABELS
    polygon = int(0)
    if is_split(case):
        for start in range(12):
            if is_crossed(case, start) and label_of(labels, start) == NO_LABEL:
                previous = int(-1)
                edge = int(start)
                running = int(1)
                while running == 1:
                    labels = with_label(labels, edge, polygon)
                    following = next_edge(case, joined, previous, edge)
                    previous = edge
                    edge = following
                    if edge == start:
                        running = 0
                polygon += 1
    else:
        for edge in range(12):
            if is_crossed(case, edge):
                labels = with_label(labels, edge, 0)
    return labels


@wp.func
def find_special(special: SpecialCells, row: wp.int32, i: wp.int32) -> wp.int64:
    """Return the number of a special cell by bisection of its row's; the cell is one."""
    low = special.starts[row]
    high = special.starts[row + 1] - wp.int64(1)
    while low < high:
        middle = (low + high) / wp.int64(2)
        if special.i[middle] < i:
            low = middle + wp.int64(1)
        else:
            high = middle
    return low


@wp.func
def is_active(grid: Grid, bits: CellBits, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether (i, j, k) is an active cell; indices may be off the grid."""
    found = bool(False)
    if i >= 0 and j >= 0 and k >= 0 and i < grid.nx - 1 and j < grid.ny - 1 and k < grid.nz - 1:
        found = has_bit(bits.active[j + k * grid.ny, i // 32], i % 32)
    return found


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
    grid: Grid, bits: CellBits, i: wp.int32, j: wp.int32, k: wp.int32, labels: wp.uint64, has_absent: wp.int32
) -> wp.uint32:
    """Return a bit for each crossed edge of cell (i, j, k) that has a quad."""
    found = wp.uint32(0)
    if has_absent == 1:
        for edge in range(12):
            if label_of(labels, edge) != NO_LABEL and edge_has_quad(grid, bits, i, j, k, edge):
                found |= wp.uint32(1) << wp.uint32(edge)
    else:  # all cells of the grid exist, so only edges in the grid's own faces have none
        bare = int(0)
        bare |= wp.where(i == 0, FACE_EDGE_BITS[0], 0) | wp.where(i == grid.nx - 2, FACE_EDGE_BITS[1], 0)
        bare |= wp.where(j == 0, FACE_EDGE_BITS[2], 0) | wp.where(j == grid.ny - 2, FACE_EDGE_BITS[3], 0)
        bare |= wp.where(k == 0, FACE_EDGE_BITS[4], 0) | wp.where(k == grid.nz - 2, FACE_EDGE_BITS[5], 0)
        for edge in range(12):
            if label_of(labels, edge) != NO_LABEL:
                found |= wp.uint32(1) << wp.uint32(edge)
        found &= ~wp.uint32(bare)
    return found


@wp.kernel
def list_special_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    starts: wp.array(dtype=wp.int64),
    # Out:
    row_out: wp.array(dtype=wp.int32),
    i_out: wp.array(dtype=wp.int32),
):
    """List the special cells. One thread a row."""
    row = first + wp.tid()
    slot = starts[row]
    if slot < starts[row + 1]:
        for w in range(grid.words):
            left = bits.active[row, w] & ~bits.ordinary[row, w]
            while left != wp.uint32(0):
                row_out[slot] = row
                i_out[slot] = 32 * w + bit_index(left)
                slot += wp.int64(1)
                left &= left - wp.uint32(1)


@wp.func
def face_value(
    field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, face: wp.int32, n: wp.int32
) -> wp.float64:
    """Return F at corner n of a face of cell (i, j, k)."""
    corner = FACE_CORNERS[4 * face + n]
    return node_value(field, grid, i + (corner & 1), j + ((corner >> 1) & 1), k + (corner >> 2))


@wp.kernel
def decide_faces_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    field: Field,
    special: SpecialCells,
    # Out:
    joined_out: wp.array(dtype=wp.uint32),
    ambiguous_out: wp.array(dtype=wp.int64),
):
    """Decide the ambiguous faces, and count those that no lower cell shares. One thread a special cell."""
    s = first + wp.tid()
    row = special.row[s]
    i = special.i[s]
    j = row % grid.ny
    k = row // grid.ny
    case = cell_case(grid, bits.inside, row, i)
    joined = wp.uint32(0)
    count = wp.int64(0)
    for face in range(6):
        if is_ambiguous(case, face):
            f03 = face_value(field, grid, i, j, k, face, 0) * face_value(field, grid, i, j, k, face, 3)
            f12 = face_value(field, grid, i, j, k, face, 1) * face_value(field, grid, i, j, k, face, 2)
            first_inside = ((case >> FACE_CORNERS[4 * face]) & 1) == 1
            if (first_inside and f03 >= f12) or (not first_inside and f12 >= f03):
                joined |= wp.uint32(1) << wp.uint32(face)
            joined |= AMBIGUOUS << wp.uint32(face)
            axis = face / 2
            low = is_active(
                grid,
                bits,
                i - wp.where(axis == 0, 1, 0),
                j - wp.where(axis == 1, 1, 0),
                k - wp.where(axis == 2, 1, 0),
            )
            if face % 2 == 1 or not low:
                count += wp.int64(1)
    joined_out[s] = joined
    ambiguous_out[s] = count


@wp.kernel
def trace_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    # Out:
    polygons_out: wp.array(dtype=wp.uint64),
):
    """Trace the polygons. One thread a special cell."""
    s = first + wp.tid()
    case = cell_case(grid, bits.inside, special.row[s], special.i[s])
    polygons_out[s] = trace_cell(case, special.joined[s])


@wp.func
def is_one_polygon(labels: wp.uint64, face: wp.int32) -> wp.bool:
    """Return whether all segments of an ambiguous face are in one polygon."""
    label = label_of(labels, FACE_EDGES[4 * face])
    same = bool(True)
    for side in range(1, 4):
        if label_of(labels, FACE_EDGES[4 * face + side]) != label:
            same = False
    return same


@wp.kernel
def flip_faces_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    axis: wp.int32,
    parity: wp.int32,
    # In/out:
    joined_inout: wp.array(dtype=wp.uint32),
    polygons_inout: wp.array(dtype=wp.uint64),
    flips_inout: wp.array(dtype=wp.int64),
):
    """Flip the bad faces of one class. One thread a special cell, for its high face on `axis`.

    Two faces of a class never share a cell, so no thread writes what another one reads.
    """
    s = first + wp.tid()
    row = special.row[s]
    i = special.i[s]
    j = row % grid.ny
    k = row // grid.ny
    plane = wp.where(axis == 0, i, wp.where(axis == 1, j, k)) + 1
    face = 2 * axis + 1
    if plane % 2 != parity or not has_bit(joined_inout[s], face + 8):
        return
    ni = i + wp.where(axis == 0, 1, 0)
    nj = j + wp.where(axis == 1, 1, 0)
    nk = k + wp.where(axis == 2, 1, 0)
    if is_active(grid, bits, ni, nj, nk) and is_one_polygon(polygons_inout[s], face):
        other_row = nj + nk * grid.ny
        other = find_special(special, other_row, ni)
        if is_one_polygon(polygons_inout[other], face - 1):
            joined = joined_inout[s] ^ (wp.uint32(1) << wp.uint32(face))
            other_joined = joined_inout[other] ^ (wp.uint32(1) << wp.uint32(face - 1))
            joined_inout[s] = joined
            joined_inout[other] = other_joined
            polygons_inout[s] = trace_cell(cell_case(grid, bits.inside, row, i), joined)
            polygons_inout[other] = trace_cell(cell_case(grid, bits.inside, other_row, ni), other_joined)
            flips_inout[s] = flips_inout[s] + wp.int64(1)


@wp.func
def label_fans(
    case: wp.int32,
    joined: wp.uint32,
    labels: wp.uint64,
    start: wp.int32,
    with_quad: wp.uint32,
    label: wp.int32,
) -> wp.uint64:
    """Give each run of edges with quads round the polygon of edge `start` its own label.

    `start` has no quad; the labels count up from `label`.
    """
    result = with_label(labels, start, NO_LABEL)
    current = int(label - 1)
    previous = int(-1)
    edge = int(start)
    following = next_edge(case, joined, previous, edge)
    while following != start:
        if has_bit(with_quad, following):
            if not has_bit(with_quad, edge):
                current += 1
            result = with_label(result, following, current)
        else:
            result = with_label(result, following, NO_LABEL)
        previous = edge
        edge = following
        following = next_edge(case, joined, previous, edge)
    return result


@wp.kernel
def number_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    splits_fans: wp.bool,
    has_absent: wp.int32,
    # Out:
    labels_out: wp.array(dtype=wp.uint64),
    polygon_count_out: wp.array(dtype=wp.int64),
    vertex_count_out: wp.array(dtype=wp.int64),
    unused_out: wp.array(dtype=wp.int64),
    multi_out: wp.array(dtype=wp.int64),
):
    """Turn polygons into vertices: none for a polygon without quads, one a fan. One thread a special cell."""
    s = first + wp.tid()
    row = special.row[s]
    i = special.i[s]
    j = row % grid.ny
    k = row // grid.ny
    case = cell_case(grid, bits.inside, row, i)
    labels = special.polygons[s]
    joined = special.joined[s]
    with_quad = edges_with_quad(grid, bits, i, j, k, labels, has_absent)
    polygons = int(0)
    for edge in range(12):
        label = label_of(labels, edge)
        if label != NO_LABEL:
            polygons = wp.max(polygons, label + 1)
    result = NO_LABELS
    vertices = int(0)
    unused = int(0)
    for polygon in range(polygons):
        bare = int(-1)  # an edge without a quad, if there is one
        quads = int(0)
        for edge in range(12):
            if label_of(labels, edge) == polygon:
                if has_bit(with_quad, edge):
                    quads += 1
                    result = with_label(result, edge, vertices)
                else:
                    bare = edge
        if quads == 0:
            unused += 1
        elif bare >= 0 and splits_fans:
            result = label_fans(case, joined, result, bare, with_quad, vertices)
            for edge in range(12):
                label = label_of(result, edge)
                if label != NO_LABEL:
                    vertices = wp.max(vertices, label + 1)
        else:
            vertices += 1
    labels_out[s] = result
    polygon_count_out[s] = wp.int64(polygons)
    vertex_count_out[s] = wp.int64(vertices)
    unused_out[s] = wp.int64(unused)
    multi_out[s] = wp.int64(wp.where(polygons > 1, 1, 0))


@wp.func
def polygon_of_vertex(special: SpecialCells, s: wp.int64, n: wp.int32) -> wp.uint32:
    """Return the edges (a bit each) of the whole polygon that vertex n of a special cell stands for."""
    polygon = int(NO_LABEL)
    for edge in range(12):
        if label_of(special.vertices[s], edge) == n:
            polygon = label_of(special.polygons[s], edge)
    edges = wp.uint32(0)
    for edge in range(12):
        if label_of(special.polygons[s], edge) == polygon:
            edges |= wp.uint32(1) << wp.uint32(edge)
    return edges


@wp.func
def special_cell_of(special: SpecialCells, count: wp.int32, n: wp.int64) -> wp.int32:
    """Return which special cell the n-th vertex of special cells belongs to, by bisection."""
    low = int(0)
    high = count
    while high - low > 1:
        middle = low + (high - low) // 2
        if special.first_vertex[middle] <= n:
            low = middle
        else:
            high = middle
    return low
