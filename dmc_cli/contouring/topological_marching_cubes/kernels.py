"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType

from dmc_cli.settings import SurfaceSettings


def surface_kernels(settings: SurfaceSettings) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, those that take longest to compile first."""
    from dmc_cli.contouring.stages import (
        cell_triangles,
        classification,
        edge_ranks,
        edge_vertices,
        second_fans,
        special_list,
    )
    from dmc_cli.contouring.topological_marching_cubes import trilinear_cells
    from dmc_cli.field import slice_kernels

    shared = [edge_vertices, classification, edge_ranks, special_list, second_fans, *slice_kernels()]
    return [cell_triangles, trilinear_cells, *shared]
