"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType

from dmc_cli.settings import SurfaceSettings


def surface_kernels(settings: SurfaceSettings) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, those that take longest to compile first."""
    from dmc_cli.contouring.dual_marching_cubes import (
        cells,
        manifold_repair,
        polygons,
        quads,
        vertices,
    )
    from dmc_cli.contouring.stages import classification
    from dmc_cli.field import slice_kernels

    placing = _placing_kernels(settings.placement)
    return [classification, cells, polygons, manifold_repair, vertices, *placing, quads, *slice_kernels()]


def _placing_kernels(placement: str | None) -> list[ModuleType]:
    """Return the modules that place vertices; the others are not even read."""
    if placement == "exact":
        from dmc_cli.contouring.dual_marching_cubes.placement import exact_scalar, exact_simd

        return [exact_simd, exact_scalar]
    from dmc_cli.contouring.dual_marching_cubes.placement import paper

    return [paper]


def mesh_kernels(*, colors: bool) -> list[ModuleType]:
    """Return the modules whose kernels halfedges need, and those of colours if they are wanted."""
    from dmc_cli.contouring.dual_marching_cubes.halfedges import grid_twins, vertex_rings
    from dmc_cli.contouring.stages import quad_ranks

    modules = [quad_ranks, grid_twins, vertex_rings]
    if colors:
        from dmc_cli.contouring.stages import coloring

        modules.append(coloring)
    return modules
