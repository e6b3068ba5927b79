"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType


def dual_kernels() -> list[ModuleType]:
    """Return the modules whose kernels the stages need, placing apart, those that compile longest first."""
    from dmc_cli.contouring.dual_grid import active_cells, cell_quads
    from dmc_cli.contouring.stages import classification
    from dmc_cli.field import slice_kernels

    return [active_cells, classification, cell_quads, *slice_kernels()]


def color_kernels(*, colors: bool) -> list[ModuleType]:
    """Return the modules whose kernels colours need, if they are wanted."""
    if not colors:
        return []
    from dmc_cli.contouring.stages import coloring, quad_ranks

    return [quad_ranks, coloring]
