"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType


def kernel_modules(*, intersections: bool) -> list[ModuleType]:
    """Return the modules whose kernels a report needs, with or without those that find intersections."""
    from dmc_cli.measures import components, deviation, elements, quality, rounding_kernels, vertex_fans
    from dmc_cli.mesh import connecting_kernels, tree_kernels

    modules = [components, deviation, rounding_kernels, quality, elements, *connecting_kernels(), vertex_fans]
    if intersections:
        from dmc_cli.measures import intersections as finding

        modules += [*tree_kernels(), finding]
    return modules
