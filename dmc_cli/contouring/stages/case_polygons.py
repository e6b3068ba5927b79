"""Trace the polygons of all 256 cases, inside corners separated; on the host, from the cube alone.

Seen from outside the cell, the corners of a face run anticlockwise. Where its inside corners are separated,
each run of them is cut off by a segment, from the edge where the run is entered to the edge where it is left.
Every crossed edge is entered in one of its two faces and left in the other, so segments join to closed
polygons, whose normals point away from the inside corners. Cells that share an ambiguous face cut it alike:
the surface has no holes, whatever the values are.
"""

from collections.abc import Iterator
from functools import cache

from dmc_cli.field import CORNERS, EDGES

Polygon = tuple[int, ...]
"""Edges of a cell, from the lowest one on; anticlockwise seen from where the normal points."""


@cache
def polygons_of_cases() -> tuple[tuple[Polygon, ...], ...]:
    """Return the polygons of each case, in the order of their lowest edges."""
    return tuple(_trace(case) for case in range(256))


def _trace(case: int) -> tuple[Polygon, ...]:
    following = {start: end for face in face_cycles() for start, end in _segments(case, face)}
    polygons = []
    while following:
        edges = [min(following)]
        while (edge := following.pop(edges[-1])) != edges[0]:
            edges.append(edge)
        polygons.append(tuple(edges))
    return tuple(polygons)


@cache
def face_cycles() -> tuple[tuple[int, ...], ...]:
    """Return the corners of each face, anticlockwise seen from outside the cell."""
    cycles = []
    for axis in range(3):
        second, third = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        low, high = (0, third, second + third, second), (0, second, second + third, third)
        cycles += [low, tuple(c + (1 << axis) for c in high)]
    return tuple(cycles)


def _segments(case: int, corners: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """Yield the segments of a face, each as the edge where it starts and where it ends."""
    inside = [case >> c & 1 for c in corners]
    for n in range(4):
        if inside[n] and not inside[n - 1]:
            last = next(m for m in range(n, n + 4) if not inside[(m + 1) % 4])
            yield _edge(corners[n - 1], corners[n]), _edge(corners[last % 4], corners[(last + 1) % 4])


def _edge(a: int, b: int) -> int:
    return EDGES.index((min(a, b), max(a, b)))


@cache
def edges_share_face(a: int, b: int) -> bool:
    """Return whether two edges lie in one face: a segment between them, on both sides of it, would too."""
    corners = {*EDGES[a], *EDGES[b]}
    return any(corners <= set(face) for face in face_cycles())


@cache
def edge_rotations() -> tuple[tuple[int, ...], ...]:
    """Return the 24 rotations of the cube, each as the edge that every edge is turned to."""
    found, new = set(), {tuple(range(12))}
    while new:
        found |= new
        new = {tuple(turn[e] for e in turned) for turned in new for turn in _quarter_turns()} - found
    return tuple(sorted(found))


def _quarter_turns() -> list[tuple[int, ...]]:
    """Return the quarter turns about z and about x, which make all rotations."""

    def turned(move: object) -> tuple[int, ...]:
        corner = [CORNERS.index(move(*place)) for place in CORNERS]  # type: ignore[operator]
        return tuple(_edge(corner[a], corner[b]) for a, b in EDGES)

    return [turned(lambda x, y, z: (1 - y, x, z)), turned(lambda x, y, z: (x, 1 - z, y))]
