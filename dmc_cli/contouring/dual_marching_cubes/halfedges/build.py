"""Build the halfedge structure of a surface from its grid (Grosso & Zint 2021, section 3.2).

Conventions: halfedge 4q + c belongs to corner c of quad q. It starts at the vertex there (its origin) and
ends at the one of corner c + 1, where the next halfedge of the quad starts. So origin, face, next and the
first halfedge of a face follow from the number and are not stored; `mesh_io/halfedge_dump.py` writes them
out. The twin runs the other way on the other side of the edge; on a boundary it is absent (-1).
"""

import warp as wp

from dmc_cli.contouring.dual_marching_cubes.halfedges.grid_twins import find_grid_twins
from dmc_cli.contouring.dual_marching_cubes.halfedges.quad_ranks import rank_quads
from dmc_cli.contouring.dual_marching_cubes.halfedges.vertex_rings import find_vertex_rings
from dmc_cli.mesh.halfedges import Halfedges, flat_quads
from dmc_cli.mesh.surface import Surface

wp.set_module_options({"enable_backward": False})


def build_halfedges(surface: Surface) -> Halfedges:
    """Return the halfedge structure of a surface as it was extracted; deterministic on any device."""
    device = surface.device
    words = rank_quads(surface.cells, surface.grid, surface.quad_starts, device)
    twins, defect = find_grid_twins(surface, words, device)
    twin = flat_quads(twins)
    vertex_halfedge, valence = find_vertex_rings(surface, words, twin, device)
    return Halfedges(surface.quads, twin, vertex_halfedge, valence, defect, words)
