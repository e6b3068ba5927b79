"""Build the halfedge structure of a surface from its grid (Grosso & Zint 2021, section 3.2)."""

from dmc_cli.contouring.dual_marching_cubes.halfedges.grid_twins import find_grid_twins
from dmc_cli.contouring.dual_marching_cubes.halfedges.quad_ranks import rank_quads
from dmc_cli.contouring.dual_marching_cubes.halfedges.vertex_rings import find_vertex_rings
from dmc_cli.mesh.halfedges import Halfedges, flat_quads
from dmc_cli.mesh.surface import Surface


def build_halfedges(surface: Surface) -> Halfedges:
    """Return the halfedge structure of a surface as it was extracted; deterministic on any device."""
    device = surface.device
    words = rank_quads(surface.cells, surface.grid, surface.quad_starts, device)
    twins, defect = find_grid_twins(surface, words, device)
    twin = flat_quads(twins)
    vertex_halfedge, valence = find_vertex_rings(surface, words, twin, device)
    return Halfedges(surface.quads, twin, vertex_halfedge, valence, defect, words)
