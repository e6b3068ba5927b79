"""Hold the result of contouring: a mesh, where its vertices lie, and what was found on the way."""

from dataclasses import dataclass
from typing import Any

from dmc_cli.mesh import Mesh, Placement
from dmc_cli.settings import Method


@dataclass(frozen=True)
class SurfaceCounts:
    """What was found on the way; the keys of the report's `surface` section.

    `polygons` counts every MC polygon of every cell, `unused_vertices` those without a quad, which give no
    vertex; with manifold topology an open border may turn one polygon into several vertices.
    """

    polygons: int
    unused_vertices: int
    crossed_edges: int
    active_cells: int
    multi_polygon_cells: int
    ambiguous_faces: int
    flipped_faces: int
    fallback_vertices: int
    no_data_nodes: int


@dataclass(frozen=True)
class Surface:
    """A mesh as a method of contouring made it.

    Attributes:
        mesh: Its vertices and faces.
        placement: Where the vertices lie.
        counts: What was found on the way.
        method: The method's word.
        numbering: How the method numbered vertices and faces along the grid, by which it connects and colours
            them; whoever drops the surface drops it.
    """

    mesh: Mesh
    placement: Placement
    counts: SurfaceCounts
    method: Method
    numbering: Any
