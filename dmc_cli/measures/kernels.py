"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType


def kernel_modules() -> list[ModuleType]:
    """Return the modules whose kernels a report needs, for loading them ahead of time."""
    from dmc_cli.measures import components, deviation, quality, rounding_kernels, vertex_fans
    from dmc_cli.mesh import connecting_kernels

    return [components, deviation, rounding_kernels, quality, *connecting_kernels(), vertex_fans]
