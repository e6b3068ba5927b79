"""Face flips that leave no non-manifold edge (Known weaknesses, 1, of the paper's notes).

An ambiguous face is bad when both its segments belong to one polygon in both of its cells: then two
mesh edges join the same two vertices. Its decision is flipped for both cells. One sweep over six
classes, x even, x odd, y even, y odd, z even, z odd (the face's index along its axis), each face
tested against the polygons as flipped so far.
"""

from itertools import product

from tests.oracle.cube import AXES
from tests.oracle.faces import Cell, Face, cell_face, cells_of_face
from tests.oracle.polygons import Polygon, face_segments, joined_faces, trace_polygons


def flip_bad_faces(cells: dict[Cell, int], decisions: dict[Face, bool]) -> set[Face]:
    """Flip the bad faces within `decisions`; returns which."""
    flipped = set()
    for axis, parity in product(AXES, (0, 1)):
        of_class = [face for face in decisions if face[0] == axis and face[1 + axis] % 2 == parity]
        for face in of_class:
            if is_bad(face, cells, decisions):
                decisions[face] = not decisions[face]
                flipped.add(face)
    return flipped


def is_bad(face: Face, cells: dict[Cell, int], decisions: dict[Face, bool]) -> bool:
    """Whether both segments of an ambiguous face lie in one polygon in both of its cells."""
    for cell in cells_of_face(face):
        if cell not in cells:
            return False
        joined = joined_faces(cell, cells[cell], decisions)
        polygons = trace_polygons(cells[cell], joined)
        number = next(f for f in range(6) if cell_face(cell, f) == face)
        segments = face_segments(cells[cell], number, decisions[face])
        owners = {owner_of(next(iter(segment)), polygons) for segment in segments}
        if len(owners) == 2:
            return False
    return True


def owner_of(edge: int, polygons: tuple[Polygon, ...]) -> int:
    """Which of a cell's polygons has the edge."""
    return next(p for p, polygon in enumerate(polygons) if edge in polygon)
