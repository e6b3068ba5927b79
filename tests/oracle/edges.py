"""How quads share edges and vertices, counted from their indices alone."""

import numpy as np

from tests.oracle.surface import OracleSurface


def vertex_pairs(quads: np.ndarray) -> np.ndarray:
    """The four sides of every quad as sorted vertex pairs, shape (4Q, 2)."""
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1)
    return np.sort(sides.reshape(-1, 2), axis=1)


def pair_use(quads: np.ndarray) -> np.ndarray:
    """How many quads each vertex pair has."""
    return np.unique(vertex_pairs(quads), axis=0, return_counts=True)[1]


def edge_use(surface: OracleSurface) -> np.ndarray:
    """How many quads each vertex pair of an oracle's surface has."""
    return pair_use(surface.indexed_quads()[1])


def pinched_vertex_count(surface: OracleSurface) -> int:
    """Vertices of an oracle's surface whose quads form more than one ring or fan."""
    vertices, quads = surface.indexed_quads()
    return int(pinched_vertices(quads, len(vertices)).sum())


def pinched_vertices(quads: np.ndarray, vertex_count: int) -> np.ndarray:
    """Whether the quads of each vertex form more than one ring or fan; vertex pairs tell neighbours.

    Quads round a vertex are neighbours if they share a side there. Counted as components by
    uniting corners that share a side, for meshes without sides of three or more quads.
    """
    corner = np.arange(quads.size).reshape(quads.shape)
    parent = np.arange(quads.size)

    def root(c: int) -> int:
        while parent[c] != c:
            parent[c] = parent[parent[c]]
            c = parent[c]
        return c

    owner: dict[tuple[int, int], int] = {}
    for q, vertices in enumerate(quads.tolist()):
        for side in range(4):
            ends = [(vertices[side], corner[q, side]), (vertices[(side + 1) % 4], corner[q, (side + 1) % 4])]
            for (v, at), (other, _) in (ends, ends[::-1]):
                first = owner.setdefault((v, other), at)
                parent[root(at)] = root(first)
    roots = np.array([root(c) for c in range(quads.size)], dtype=np.int64)
    groups = np.unique(np.stack([quads.ravel(), roots], axis=1), axis=0)[:, 0]
    return np.bincount(groups, minlength=vertex_count) > 1
