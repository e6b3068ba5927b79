"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType


def dual_kernels() -> list[ModuleType]:
    """Return the modules whose kernels the stages need, placing apart, those that compile longest first."""
    from dmc_cli.contouring.dual_grid import active_cells, cell_quads
    from dmc_cli.contouring.stages import classification
    from dmc_cli.field import slice_kernels

    return [active_cells, classification, cell_quads, *slice_kernels()]


def connecting_dual_kernels(*, colors: bool) -> list[ModuleType]:
    """Return the modules whose kernels halfedges need, and those of colours if they are wanted."""
    from dmc_cli.contouring.dual_grid import cell_twins
    from dmc_cli.contouring.stages import quad_ranks
    from dmc_cli.mesh import connecting_kernels

    modules = [cell_twins, quad_ranks, *connecting_kernels()]
    if colors:
        from dmc_cli.contouring.stages import coloring

        modules.append(coloring)
    return modules
