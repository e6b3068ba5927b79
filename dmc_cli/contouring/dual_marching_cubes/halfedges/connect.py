"""Connect the quads of a surface by halfedges, from its grid (Grosso & Zint 2021, section 3.2)."""

from dataclasses import replace

from dmc_cli.contouring.dual_marching_cubes.halfedges.grid_twins import find_grid_twins
from dmc_cli.contouring.dual_marching_cubes.halfedges.vertex_rings import find_vertex_rings
from dmc_cli.contouring.stages.numbering import numbering_of
from dmc_cli.contouring.stages.quad_ranks import rank_quads
from dmc_cli.contouring.surface import Surface
from dmc_cli.mesh import DEFECT, Halfedges, flat_corners


def connect(surface: Surface) -> Surface:
    """Return the surface with halfedges and with the quads' defects; deterministic on any device."""
    numbering, grid, device = numbering_of(surface), surface.placement.frame.grid, surface.mesh.device
    words = rank_quads(numbering.cells, grid, numbering.quad_starts, device)
    surface = replace(surface, numbering=replace(numbering, quad_words=words))
    twins, defect = find_grid_twins(surface)
    twin = flat_corners(twins)
    vertex_halfedge, valence = find_vertex_rings(surface, twin)
    mesh = replace(surface.mesh, halfedges=Halfedges(twin, vertex_halfedge, valence))
    return replace(surface, mesh=mesh.with_face_values({DEFECT: defect}))
