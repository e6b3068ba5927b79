"""The cube between eight nodes: corners, edges and faces, with the paper's numbers (its figure 1).

Corner c sits at (c & 1, c >> 1 & 1, c >> 2). Face 2 * axis + side lies across `axis`, on the low
side (0) or the high side (1).
"""

from functools import cache
from itertools import permutations, product

AXES = (0, 1, 2)
CORNERS = tuple((c & 1, c >> 1 & 1, c >> 2) for c in range(8))
EDGES = (
    (0, 1), (1, 3), (2, 3), (0, 2),
    (4, 5), (5, 7), (6, 7), (4, 6),
    (0, 4), (1, 5), (3, 7), (2, 6),
)  # fmt: skip
FACES = tuple((axis, side) for axis in AXES for side in (0, 1))


def corner_at(position: tuple[int, ...]) -> int:
    """Number of the corner at a position of zeros and ones."""
    return CORNERS.index(tuple(position))


def edge_between(corner: int, other: int) -> int:
    """Number of the edge between two corners."""
    return EDGES.index((min(corner, other), max(corner, other)))


@cache
def face_corners(face: int) -> tuple[int, ...]:
    """The four corners f0 f1 f2 f3 of a face; f0 and f3 are diagonal, and so are f1 and f2."""
    axis, side = FACES[face]
    return tuple(c for c in range(8) if CORNERS[c][axis] == side)


@cache
def face_edges(face: int) -> tuple[int, ...]:
    """The four edges that lie in a face."""
    corners = face_corners(face)
    return tuple(e for e, (a, b) in enumerate(EDGES) if a in corners and b in corners)


@cache
def share_face(edge: int, other: int) -> bool:
    """Whether two edges lie in one face."""
    return any({edge, other} <= set(face_edges(face)) for face in range(6))


@cache
def edge_axis(edge: int) -> int:
    """The axis along which an edge runs."""
    a, b = EDGES[edge]
    return next(axis for axis in AXES if CORNERS[a][axis] != CORNERS[b][axis])


@cache
def edge_at(axis: int, position: tuple[int, int, int]) -> int:
    """Number of the edge along `axis` whose lower corner is at `position`."""
    upper = list(position)
    upper[axis] = 1
    return edge_between(corner_at(position), corner_at(tuple(upper)))


@cache
def crossed_edges(case: int) -> frozenset[int]:
    """Edges with one corner inside and one outside; bit c of `case` is set for inside corners."""
    return frozenset(e for e, (a, b) in enumerate(EDGES) if (case >> a & 1) != (case >> b & 1))


@cache
def is_ambiguous(case: int, face: int) -> bool:
    """Whether a face has its two inside corners on one diagonal, its outside ones on the other."""
    f0, f1, f2, f3 = (case >> c & 1 for c in face_corners(face))
    return f0 == f3 and f1 == f2 and f0 != f1


def rotations() -> list[tuple[int, ...]]:
    """The 24 rotations of the cube, each as the new number of every corner."""
    found = []
    for order in permutations(AXES):
        for mirrored in product((0, 1), repeat=3):
            swaps = sum(order[a] > order[b] for a in AXES for b in AXES if a < b)
            if (swaps + sum(mirrored)) % 2 == 0:
                found.append(
                    tuple(
                        corner_at(tuple(CORNERS[c][order[a]] ^ mirrored[a] for a in AXES)) for c in range(8)
                    )
                )
    return found
