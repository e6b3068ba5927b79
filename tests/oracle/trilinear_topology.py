"""The topology of the trilinear isosurface of many volumes at once, from values and decider alone.

Volumes lie side by side in one grid, a block of cells each, with nodes without data between them. Crossed
edges, face segments and polygons make a complex whose Euler characteristic is the surface's but for tunnels:
two polygons of a cell that are one ring take two away. Where the surface of a cell has a tunnel is decided in
whole numbers, ties as the isovalue less an infinitesimal, without a look at the surface's lines or a mesh.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tests.oracle.cube import CORNERS, EDGES, edge_axis, face_corners, is_ambiguous
from tests.oracle.grid import Grid
from tests.oracle.polygons import trace_polygons

SCALE = 110
"""Two to this power makes whole numbers of the values."""

BETWEEN = 2**400
"""How many infinitesimals are one: so many that no sum of products of values comes near them."""


@dataclass(frozen=True)
class Topology:
    """What each block has, arrays of int: Euler characteristic, Betti numbers, tunnels."""

    euler: np.ndarray
    b0: np.ndarray
    b1: np.ndarray
    b2: np.ndarray
    tunnels: np.ndarray

    def rows(self) -> np.ndarray:
        """All of them, shape (blocks, 5)."""
        return np.column_stack([self.euler, self.b0, self.b1, self.b2, self.tunnels])


def topology_of_blocks(grid: Grid, block_of_cell: np.ndarray, blocks: int) -> Topology:
    """The topology in each block; `block_of_cell` is [k, j, i] over the cells."""
    cases = grid.cases()
    at = np.argwhere(grid.existing_cells() & (cases != 0) & (cases != 255))
    case, block = cases[tuple(at.T)], block_of_cell[tuple(at.T)]
    values = np.stack([plane[tuple(at.T)] for plane in grid.corner_planes(grid.distance)], axis=1)
    joined = joined_bits(values, case)
    has_tunnel = np.zeros(len(at), bool)
    edges, links, sides, counts = edges_of_cells(grid, at), [], [], np.zeros(len(at), int)
    keys, key_of = np.unique(case * 64 + joined, return_inverse=True)
    for number, key in enumerate(keys.tolist()):
        cells = np.flatnonzero(key_of == number)
        polygons = trace_polygons(key >> 6, tuple(bool(key >> face & 1) for face in range(6)))
        counts[cells] = len(polygons)
        for polygon in polygons:
            along = edges[cells][:, polygon]
            sides.append(np.stack([along, np.roll(along, 1, axis=1)], axis=-1).reshape(-1, 2))
        if len(polygons) > 1:
            found = cells[hexagon_is_inside(values[cells])]
            has_tunnel[found] = True
            for cell in found.tolist():
                ends = [polygon[0] for polygon in tunnel_polygons(values[cell], polygons)]
                links.append(edges[cell][ends])
    return _sums(edges, sides, links, counts, has_tunnel, block, blocks)


def _sums(edges, sides, links, counts, has_tunnel, block, blocks) -> Topology:
    """Put together what `topology_of_blocks` has found of the cells."""
    pairs = np.sort(np.concatenate(sides), axis=1)
    nodes, pairs = np.unique(pairs, return_inverse=True)
    pairs = pairs.reshape(-1, 2)
    block_of_node = np.zeros(len(nodes), int)
    place = np.minimum(np.searchsorted(nodes, edges), len(nodes) - 1)
    is_crossed = nodes[place] == edges
    block_of_node[place[is_crossed]] = np.broadcast_to(block[:, None], edges.shape)[is_crossed]
    segments, uses = np.unique(pairs, axis=0, return_counts=True)
    assert uses.max() <= 2
    ring = np.searchsorted(nodes, np.array(links, dtype=np.int64).reshape(-1, 2))
    joins = np.concatenate([segments, ring])
    graph = coo_array((np.ones(len(joins)), tuple(joins.T)), shape=(len(nodes),) * 2)
    count, component = connected_components(graph, directed=False)
    is_open = np.zeros(count, bool)
    is_open[component[segments[uses == 1]]] = True
    block_of_component = np.zeros(count, int)
    block_of_component[component] = block_of_node
    tunnels = np.bincount(block[has_tunnel], minlength=blocks)
    euler = (
        np.bincount(block_of_node, minlength=blocks)
        - np.bincount(block_of_node[segments[:, 0]], minlength=blocks)
        + np.bincount(block, weights=counts, minlength=blocks).astype(int)
        - 2 * tunnels
    )
    b0 = np.bincount(block_of_component, minlength=blocks)
    b2 = np.bincount(block_of_component[~is_open], minlength=blocks)
    return Topology(euler=euler, b0=b0, b1=b0 + b2 - euler, b2=b2, tunnels=tunnels)


def edges_of_cells(grid: Grid, at: np.ndarray) -> np.ndarray:
    """The twelve grid edges of cells [k, j, i], a number each, shape (n, 12)."""
    nz, ny, nx = grid.distance.shape
    lowest = (at[:, 0] * ny + at[:, 1]) * nx + at[:, 2]
    starts = [CORNERS[low] for low, _ in EDGES]
    steps = [edge_axis(e) * nx * ny * nz + i + nx * (j + ny * k) for e, (i, j, k) in enumerate(starts)]
    return lowest[:, None] + np.array(steps)


def joined_bits(values: np.ndarray, case: np.ndarray) -> np.ndarray:
    """A bit for each face of a cell: whether the asymptotic decider joins its inside corners.

    Products of float32 values are exact in double precision.
    """
    ambiguous = np.array([[is_ambiguous(c, face) for face in range(6)] for c in range(256)])
    bits = np.zeros(len(case), int)
    for face in range(6):
        f0, f1, f2, f3 = values[:, face_corners(face)].T
        joins = np.where(f0 >= 0, f0 * f3 >= f1 * f2, f1 * f2 >= f0 * f3)
        bits |= (ambiguous[case, face] & joins).astype(int) << face
    return bits


def hexagon_is_inside(values: np.ndarray) -> np.ndarray:
    """Whether cells (n, 8) have both roots of every axis inside, where a cut falls into two lines.

    Across an axis the determinant of a cut is a quadratic: both its roots are in the open interval if it has
    the sign of its leading coefficient at both ends and, between them, its least or greatest value, which has
    the other sign.
    """
    scaled = values * 2.0**SCALE
    assert (np.abs(scaled) < 2.0**900).all()
    whole = np.array([int(v) for v in scaled.ravel()], dtype=object).reshape(-1, 8)
    assert (whole.astype(float) == scaled).all()
    f = whole * BETWEEN + 1
    inside = np.ones(len(values), bool)
    for axis in range(3):
        step, second, third = (1 << n % 3 for n in (axis, axis + 1, axis + 2))
        low = [f[:, corner] for corner in (0, second, third, second + third)]
        high = [f[:, corner + step] for corner in (0, second, third, second + third)]
        start = low[0] * low[3] - low[1] * low[2]
        end = high[0] * high[3] - high[1] * high[2]
        p, q, r, s = (b - a for a, b in zip(low, high, strict=True))
        a = p * s - q * r
        b = end - start - a
        has_roots = b * b - 4 * a * start > 0
        same_sign = (start * a > 0) & (end * a > 0)
        between = (a * b < 0) & (b * b < -2 * a * b)
        inside &= (has_roots & same_sign & between).astype(bool)
    return inside


def tunnel_polygons(values: np.ndarray, polygons: tuple) -> list:
    """The two polygons of a cell that the tunnel joins.

    Of three polygons one is a triangle apart from it: the corner that it cuts off is connected with no other
    one of its sign in the cell, as samples of the interpolant tell.
    """
    if len(polygons) == 2:
        return list(polygons)
    triangles = [polygon for polygon in polygons if len(polygon) == 3]
    corners = [
        set.intersection(*(set(EDGES[e]) for e in polygon)).pop() for polygon in triangles
    ]  # the three edges of a triangle meet in it
    for samples in (24, 48, 96, 192):
        free = [corner for corner in corners if is_alone(values, corner, samples)]
        if len(free) == 1:
            kept = triangles[corners.index(free[0])]
            return [polygon for polygon in polygons if polygon != kept]
    raise AssertionError(f"a tunnel too thin to be seen: {values.tolist()}")


def is_alone(values: np.ndarray, corner: int, samples: int) -> bool:
    """Whether a corner is connected with no other one of its sign in a cell, by samples along each axis."""
    along = np.linspace(0.0, 1.0, samples + 1)
    f = values.reshape(2, 2, 2)
    for axis in range(3):
        f = np.apply_along_axis(lambda ends: ends[0] + along * (ends[1] - ends[0]), axis, f)
    part = label((f >= 0) == (values[corner] >= 0))[0][::samples, ::samples, ::samples].ravel()
    others = [c for c in range(8) if c != corner and (values[c] >= 0) == (values[corner] >= 0)]
    return all(part[c] != part[corner] for c in others)
