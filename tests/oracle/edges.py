"""Count how quads share sides and vertices, from their indices alone."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tests.oracle.surface import OracleSurface


def vertex_pairs(quads: np.ndarray) -> np.ndarray:
    """One number for the vertex pair of each side of each quad, shape (4Q,), whatever its direction."""
    ends = quads.astype(np.int64)
    after = np.roll(ends, -1, axis=1)
    return (np.minimum(ends, after) * (ends.max(initial=0) + 1) + np.maximum(ends, after)).ravel()


def pair_use(quads: np.ndarray) -> np.ndarray:
    """How many quads each vertex pair has."""
    return np.unique(vertex_pairs(quads), return_counts=True)[1]


def pair_valences(quads: np.ndarray, vertex_count: int) -> np.ndarray:
    """How many vertex pairs each vertex is in, shape (vertex_count,)."""
    pairs = np.unique(vertex_pairs(quads))
    size = int(quads.max(initial=0)) + 1
    return np.bincount(np.concatenate([pairs // size, pairs % size]), minlength=vertex_count)


def edge_use(surface: OracleSurface) -> np.ndarray:
    """How many quads each vertex pair of an oracle's surface has."""
    return pair_use(surface.indexed_quads()[1])


def pinched_vertex_count(surface: OracleSurface) -> int:
    """Vertices of an oracle's surface whose quads form more than one ring or fan."""
    vertices, quads = surface.indexed_quads()
    return int(pinched_vertices(quads, len(vertices)).sum())


def pinched_vertices(quads: np.ndarray, vertex_count: int) -> np.ndarray:
    """Whether the quads of each vertex form more than one ring or fan, shape (vertex_count,).

    Quads round a vertex are neighbours if they share a side there; rings and fans are the components
    of the quads' corners under this. For meshes without a side of more than two quads.
    """
    corners = np.arange(quads.size).reshape(quads.shape)
    origin, corner = quads.astype(np.int64).ravel(), corners.ravel()
    head, head_corner = np.roll(quads, -1, axis=1).ravel(), np.roll(corners, -1, axis=1).ravel()
    _, side = np.unique(vertex_pairs(quads), return_inverse=True)
    # a side has one node at either end; a corner is joined to its two sides' nodes at its vertex
    at_low, at_high = quads.size + 2 * side, quads.size + 2 * side + 1
    ends = np.where(origin < head, [at_low, at_high], [at_high, at_low])
    rows, columns = np.concatenate([corner, head_corner]), np.concatenate(list(ends))
    size = 3 * quads.size + 1
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(size, size))
    _, component = connected_components(graph, directed=False)
    fans = np.unique(origin * size + component[: quads.size]) // size
    return np.bincount(fans, minlength=vertex_count) > 1
