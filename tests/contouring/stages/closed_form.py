"""The Euler characteristic of a surface, from the grid alone: crossed edges - face segments + polygons.

An edge beside missing cells counts once for each fan of polygons that it has.
"""

import numpy as np

from tests.oracle.edge_mesh import edges_with_two_fans, numbered_edges
from tests.oracle.faces import face_corner_planes, face_exists
from tests.oracle.grid import Grid
from tests.oracle.polygons import active_cells, joined_faces, trace_polygons


def face_segment_count(grid: Grid) -> int:
    """How many segments the faces of existing cells have: two on an ambiguous face."""
    cells = grid.existing_cells()
    count = 0
    for axis in range(3):
        corners = face_corner_planes(grid.inside.astype(int), axis)
        inside = sum(corners)
        is_ambiguous = (inside == 2) & (corners[0] == corners[3])
        exists = face_exists(cells, axis)
        count += int(np.sum(exists & (inside % 4 != 0))) + int(np.sum(exists & is_ambiguous))
    return count


def fan_count(grid: Grid) -> int:
    """How many fans of polygons the crossed edges have."""
    return len(numbered_edges(grid)) + len(edges_with_two_fans(grid))


def separated_euler_characteristic(grid: Grid) -> int:
    """That of marching cubes, inside corners separated."""
    polygons = sum(len(trace_polygons(case, (False,) * 6)) for case in active_cells(grid).values())
    return fan_count(grid) - face_segment_count(grid) + polygons


def decided_euler_characteristic(grid: Grid, decisions: dict) -> int:
    """That of the polygons by the decider, without tunnels."""
    polygons = sum(
        len(trace_polygons(case, joined_faces(cell, case, decisions)))
        for cell, case in active_cells(grid).items()
    )
    return fan_count(grid) - face_segment_count(grid) + polygons
