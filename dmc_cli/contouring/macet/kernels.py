"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType

from dmc_cli.settings import SurfaceSettings


def surface_kernels(settings: SurfaceSettings) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, those that take longest to compile first."""
    from dmc_cli.contouring.macet import edge_guard, moved_triangles, smoothing, surface_steps
    from dmc_cli.contouring.stages import (
        classification,
        edge_ranks,
        edge_vertices,
        second_fans,
        special_list,
    )
    from dmc_cli.field import slice_kernels

    own = [surface_steps, moved_triangles, smoothing, edge_guard]
    shared = [edge_vertices, classification, edge_ranks, special_list, second_fans]
    return [*own, *shared, *slice_kernels()]
