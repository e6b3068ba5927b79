"""What can be said of a mesh: topology, quality, deviation, and the report that gathers it."""

from types import ModuleType


def kernel_modules() -> list[ModuleType]:
    """Return the modules whose kernels a report needs, for loading them ahead of time."""
    from dmc_cli.report import components, deviation, measure_rounding, quality, twins, vertex_fans

    return [components, deviation, measure_rounding, quality, twins, vertex_fans]
