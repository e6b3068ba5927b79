"""The whole surface of the oracle: polygons, vertices and quads of a volume."""

from dataclasses import dataclass

import numpy as np

from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.oracle.faces import Cell, Face, decide_faces
from tests.oracle.flips import flip_bad_faces
from tests.oracle.grid import Grid, cut_grid
from tests.oracle.polygons import Polygon, active_cells, trace_cells
from tests.oracle.quads import (
    GridEdge,
    Vertex,
    cells_round,
    crossed_grid_edges,
    edges_with_quad,
    vertices_of_cells,
)


@dataclass(frozen=True)
class OracleSurface:
    """Polygons by cell, decisions by ambiguous face, and the quads, in grid order of their edges.

    `quads` holds a grid edge and its four vertices in cyclic order; `decisions` are those in force,
    after the flips of the faces in `flipped`.
    """

    grid: Grid
    cells: dict[Cell, int]
    decisions: dict[Face, bool]
    flipped: set[Face]
    polygons: dict[Cell, tuple[Polygon, ...]]
    quads: list[tuple[GridEdge, tuple[Vertex, ...]]]

    @property
    def polygon_count(self) -> int:
        """Number of MC polygons of all cells, unused ones included."""
        return sum(len(polygons) for polygons in self.polygons.values())

    @property
    def unused_count(self) -> int:
        """Number of MC polygons that no quad uses."""
        used = {(v.cell, v.polygon) for _, vertices in self.quads for v in vertices}
        return self.polygon_count - len(used)

    @property
    def crossed_edge_count(self) -> int:
        """Number of crossed grid edges, those without a quad included."""
        return len(crossed_grid_edges(self.grid))

    def indexed_quads(self) -> tuple[list[Vertex], np.ndarray]:
        """The vertices in order of first use, and the quads as their indices, shape (Q, 4)."""
        index: dict[Vertex, int] = {}
        quads = [[index.setdefault(v, len(index)) for v in corners] for _, corners in self.quads]
        return list(index), np.array(quads, dtype=np.int64).reshape(-1, 4)


def points_along_edge(lower_is_inside: bool, settings: SurfaceSettings, *, determinant: float) -> bool:
    """Whether a quad's normal points along its grid edge, in the order of its vertices.

    Values fall along the edge if its lower node is inside. Gradient normals point to higher values,
    outward ones out of the object. A mirroring map to the world turns every normal round.
    """
    to_lower_values = settings.orientation == "outward" and settings.inside == "above"
    return (lower_is_inside == to_lower_values) == (determinant > 0)


def extract_oracle_surface(volume: Volume, settings: SurfaceSettings) -> OracleSurface:
    """Polygons and quads of a volume, one obvious step after the other."""
    grid = cut_grid(volume, settings)
    cells = active_cells(grid)
    decisions = decide_faces(grid)
    manifold = settings.topology == "manifold"
    flipped = flip_bad_faces(cells, decisions) if manifold else set()
    polygons = trace_cells(cells, decisions)
    edges = edges_with_quad(grid, cells)
    vertex_at = vertices_of_cells(polygons, edges, split_fans=manifold)
    determinant = float(np.linalg.det(volume.affine[:3, :3]))
    inside = grid.inside
    quads = []
    for edge in edges:
        _, i, j, k = edge
        corners = tuple(vertex_at[place] for place in cells_round(edge))
        if not points_along_edge(bool(inside[k, j, i]), settings, determinant=determinant):
            corners = corners[::-1]
        quads.append((edge, corners))
    return OracleSurface(grid, cells, decisions, flipped, polygons, quads)
