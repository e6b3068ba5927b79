"""Compare a mesh on the grid's edges with the oracle's: the vertices, and the triangles of each polygon."""

from collections import Counter

import numpy as np

from dmc_cli.contouring import Surface
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.oracle.cube import share_face
from tests.oracle.edge_mesh import (
    crossings,
    edge_of_cell,
    edges_with_two_fans,
    numbered_edges,
    ordered_edges,
    separated_polygons,
)
from tests.oracle.edges import pinched_vertices
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


def without_copies(surface: Surface, grid: Grid, numbers: dict) -> np.ndarray:
    """The triangles with the vertices that a second fan has for itself named as the first fan's.

    Fails unless the last vertices are these copies, each of another edge that has two fans.
    """
    triangles, count = surface.mesh.faces.numpy()[:, :3], len(surface.placement.cell)
    expected = {numbers[edge] for edge in edges_with_two_fans(grid)}
    first = count - len(expected)
    cell, local = surface.placement.cell.numpy(), surface.placement.local.numpy()
    places = {(cell[v], local[v].tobytes()): v for v in sorted(expected)}
    named = np.arange(count)
    named[first:] = [places.get((cell[v], local[v].tobytes()), -1) for v in range(first, count)]
    assert set(named[first:].tolist()) == expected
    positions = surface.mesh.positions.numpy()
    assert (positions == positions[named]).all()
    assert not pinched_vertices(triangles, count).any()
    assert len(np.unique(triangles)) == count, "a vertex belongs to no triangle"
    return named[triangles]


def assert_marching_cubes(surface: Surface, volume: Volume, chosen: SurfaceSettings) -> None:
    """Fail unless the mesh is that of marching cubes, inside corners separated."""
    grid = cut_grid(volume, chosen)
    numbers = assert_vertices(surface, grid)
    assert (surface.mesh.faces.numpy()[:, 3] == -1).all()
    triangles = without_copies(surface, grid, numbers)
    assert len(surface.placement.cell) == len(numbers) + len(edges_with_two_fans(grid))
    assert surface.mesh.triangle_count == len(triangles)
    determinant = float(np.linalg.det(volume.affine[:3, :3]))
    start = 0
    for cell, polygon in separated_polygons(grid, chosen, determinant):
        found = triangles[start : start + len(polygon) - 2]
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
    assert not any(share_face(a, b) for a, b in inner)
