"""Describe a mesh without its coordinates: pieces, holes, handles, valences, defects.

Everything follows the twins: two faces are neighbours where their halfedges are twins, an edge is a pair of
twins or a boundary halfedge. So a mesh whose twins come from the grid is measured as the surface that it
is, also where four quads share two vertices by chance. Only the valence and the defects are by vertex pair,
as readers of a file see them, who have no twins.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.measures.components import count_roots, label_components, label_loops, list_boundary
from dmc_cli.measures.vertex_fans import VertexFans, inspect_vertices
from dmc_cli.mesh import Mesh, connect, regular_valence


@dataclass(frozen=True, kw_only=True)
class Topology:
    """What can be said of a mesh without its coordinates.

    Attributes:
        components: Sets of faces that are connected through twins.
        euler_characteristic: V - E + F of the vertices that faces use; edges are pairs of twins and boundary
            halfedges.
        genus: components - (euler_characteristic + boundary_loops) / 2: handles of all components together;
            None if the mesh is not manifold.
        betti_numbers: Components, independent loops, and closed components: b1 is b0 + b2 -
            euler_characteristic; None if the mesh is not manifold.
        boundary_edges: Halfedges without a twin.
        boundary_loops: Closed lines of boundary halfedges.
        non_manifold_edges: Vertex pairs that more than two faces have.
        non_manifold_vertices: Vertices whose faces form more than one ring or fan through twins.
        misoriented_edges: Vertex pairs whose only two faces run them the same way, so that they cannot be
            twins.
        unused_vertices: Vertices that no face uses; all other figures leave them out.
        valence_histogram: Number of vertices by valence, ascending; valence is the number of distinct mesh
            edges by vertex pair.
        irregular_percent: Share of the vertices that faces use whose valence is not 4 (6 if all faces are
            triangles, `regular_valence`); 0 without any.
    """

    components: int
    euler_characteristic: int
    genus: int | None
    betti_numbers: tuple[int, int, int] | None
    boundary_edges: int
    boundary_loops: int
    non_manifold_edges: int
    non_manifold_vertices: int
    misoriented_edges: int
    unused_vertices: int
    valence_histogram: dict[int, int]
    irregular_percent: float

    @property
    def is_manifold(self) -> bool:
        """Return whether the mesh is an oriented 2-manifold, with or without a boundary."""
        return not (self.non_manifold_edges or self.non_manifold_vertices or self.misoriented_edges)

    @property
    def is_closed(self) -> bool:
        """Return whether no edge is a boundary."""
        return self.boundary_edges == 0


def measure_topology(mesh: Mesh) -> Topology:
    """Measure everything about a mesh of triangles and quads that its coordinates do not change.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    mesh = connect(mesh)
    halfedges = mesh.require_halfedges()
    device, corners, twins = mesh.device, mesh.corners, halfedges.twin
    vertex_count, face_count = mesh.vertex_count, mesh.face_count
    boundary = list_boundary(device, corners, twins)
    boundary_edges = boundary.shape[0]
    loops = count_roots(label_loops(device, corners, twins, boundary))
    labels = label_components(device, twins)
    components = count_roots(labels)
    fans = inspect_vertices(mesh)

    counts = np.bincount(fans.valences)
    unused = int(counts[0]) if counts.shape[0] else 0
    edges = (fans.corner_count + boundary_edges) // 2
    euler = vertex_count - unused - edges + face_count
    return Topology(
        components=components,
        euler_characteristic=euler,
        genus=components - (euler + loops) // 2 if _is_manifold(fans) else None,
        betti_numbers=_betti_numbers(components, components - _open_components(labels, boundary), euler)
        if _is_manifold(fans)
        else None,
        boundary_edges=boundary_edges,
        boundary_loops=loops,
        non_manifold_edges=fans.nonmanifold_edges,
        non_manifold_vertices=fans.split_vertices,
        misoriented_edges=fans.misoriented_edges,
        unused_vertices=unused,
        valence_histogram={v: int(n) for v, n in enumerate(counts) if v and n},
        irregular_percent=_irregular_percent(counts, regular_valence(mesh)),
    )


def _open_components(labels: Any, boundary: Any) -> int:
    """Count the components that have a boundary halfedge; `labels` are those of `label_components`."""
    parents = labels.numpy()
    roots = np.unique(boundary.numpy() >> 2)
    while (above := np.unique(parents[roots])).tolist() != roots.tolist():
        roots = above
    return len(roots)


def _betti_numbers(components: int, closed: int, euler: int) -> tuple[int, int, int]:
    """Return the Betti numbers of an oriented surface."""
    return components, components + closed - euler, closed


def _is_manifold(fans: VertexFans) -> bool:
    return not (fans.nonmanifold_edges or fans.split_vertices or fans.misoriented_edges)


def _irregular_percent(counts: Any, regular: int) -> float:
    """Return the share in percent of used vertices whose valence is not the regular one."""
    used = int(counts[1:].sum())
    fitting = int(counts[regular]) if counts.shape[0] > regular else 0
    return 100.0 * (used - fitting) / used if used else 0.0
