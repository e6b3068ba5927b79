"""Hold the result of contouring: a mesh, where its vertices lie, and what was found on the way."""

from dataclasses import dataclass
from typing import Any, Protocol

from dmc_cli.mesh import Mesh, Placement


class Reserve(Protocol):
    """Told what a method is about to take memory for; it may raise."""

    def __call__(
        self, vertices: int, faces: int, *, near: int | None = None, cells: int | None = None
    ) -> None:
        """Hold what is known against the memory that there is.

        Args:
            vertices: Vertices of the mesh, at least that many.
            faces: Its faces, where nodes are without data at most that many.
            near: Words of 32 nodes that are near the surface; None if that is not known, or told before.
            cells: Cells of which the method keeps a record; None if it was told before.
        """


@dataclass(frozen=True, kw_only=True)
class SurfaceCounts:
    """What was found on the way; the keys of the report's `surface` section, None where a method has none.

    `polygons` counts every MC polygon of every cell, `unused_vertices` those without a quad, which give no
    vertex; with manifold topology an open border may turn one polygon into several vertices.
    """

    polygons: int | None = None
    unused_vertices: int | None = None
    crossed_edges: int | None = None
    active_cells: int | None = None
    multi_polygon_cells: int | None = None
    ambiguous_faces: int | None = None
    flipped_faces: int | None = None
    fallback_vertices: int | None = None
    tunnel_cells: int | None = None
    no_data_nodes: int


@dataclass(frozen=True)
class Surface:
    """A mesh as a method of contouring made it.

    Attributes:
        mesh: Its vertices and faces.
        placement: Where the vertices lie.
        counts: What was found on the way.
        method: The method's name.
        numbering: How the method numbered vertices and faces along the grid, by which it connects and colours
            them; None if it needs none for that. Whoever drops the surface drops it.
    """

    mesh: Mesh
    placement: Placement
    counts: SurfaceCounts
    method: str
    numbering: Any = None
