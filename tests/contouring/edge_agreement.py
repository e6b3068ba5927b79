"""Compare a mesh on the grid's edges with the oracle's: the vertices, and the triangles of each polygon."""

from collections import Counter

import numpy as np

from dmc_cli.contouring import Surface
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.oracle.cube import face_edges
from tests.oracle.edge_mesh import (
    crossings,
    edge_of_cell,
    numbered_edges,
    ordered_edges,
    separated_polygons,
)
from tests.oracle.grid import Grid, cut_grid


def assert_vertices(surface: Surface, grid: Grid) -> dict:
    """Fail unless the first vertices are the oracle's, in its order; return the number of each edge."""
    edges = ordered_edges(grid)
    count = len(edges)
    assert len(surface.placement.cell) >= count
    local, cell = surface.placement.local.numpy()[:count], surface.placement.cell.numpy()[:count]
    k, j, i = np.unravel_index(cell, grid.distance.shape)
    assert np.pad(grid.existing_cells(), (0, 1))[k, j, i].all(), "a vertex lies in a cell that does not exist"
    expected = (edges[:, 1:] - np.column_stack([i, j, k])).astype(np.float32)
    expected[np.arange(count), edges[:, 0]] += crossings(grid, edges)
    np.testing.assert_array_equal(local, expected)
    return numbered_edges(grid)


def assert_marching_cubes(surface: Surface, volume: Volume, chosen: SurfaceSettings) -> None:
    """Fail unless the mesh is that of marching cubes, inside corners separated."""
    grid = cut_grid(volume, chosen)
    numbers = assert_vertices(surface, grid)
    assert len(numbers) == len(surface.placement.cell)
    triangles = surface.mesh.faces.numpy()
    assert (triangles[:, 3] == -1).all()
    assert surface.mesh.triangle_count == len(triangles)
    determinant = float(np.linalg.det(volume.affine[:3, :3]))
    start = 0
    for cell, polygon in separated_polygons(grid, chosen, determinant):
        found = triangles[start : start + len(polygon) - 2, :3]
        start += len(found)
        names = {numbers[edge_of_cell(cell, edge)]: edge for edge in polygon}
        assert_triangulated(polygon, [[names[v] for v in triangle] for triangle in found.tolist()])
    assert start == len(triangles)


def assert_triangulated(polygon, triangles) -> None:
    """Fail unless triangles fill a polygon, the same way round, without a diagonal in a face of the cell."""
    sides = Counter((t[n], t[(n + 1) % 3]) for t in triangles for n in range(3))
    border = {(polygon[n - 1], polygon[n]) for n in range(len(polygon))}
    inner = set(sides) - border
    assert border <= set(sides)
    assert all((b, a) in inner for a, b in inner)
    assert max(sides.values()) == 1
    assert not any({a, b} <= set(face_edges(face)) for a, b in inner for face in range(6))
