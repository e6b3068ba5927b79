"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType


def kernel_modules(
    *,
    simplify: bool = False,
    relax: bool = False,
    remesh: bool = False,
    repair: bool = False,
    decimate: bool = False,
) -> list[ModuleType]:
    """Return the modules whose kernels the stages need, for loading them ahead of time."""
    modules: list[ModuleType] = []
    if simplify:
        from dmc_cli.bits import selection_kernels
        from dmc_cli.mesh import changing_kernels
        from dmc_cli.processing import color_repair
        from dmc_cli.processing.patterns import pattern_kernels

        modules += [color_repair, *pattern_kernels(), *selection_kernels(), *changing_kernels()]
    if remesh or decimate:
        from dmc_cli.processing import distance_guard
        from dmc_cli.processing.remeshing import region_kernels, remeshing_kernels

        modules += [distance_guard, *region_kernels(), *(remeshing_kernels() if remesh else [])]
    if decimate:
        from dmc_cli.bits import selection_kernels
        from dmc_cli.mesh import changing_kernels
        from dmc_cli.processing import color_repair
        from dmc_cli.processing.decimation import decimation_kernels

        modules += [color_repair, *selection_kernels(), *changing_kernels(), *decimation_kernels()]
    if repair:
        from dmc_cli.processing import intersection_repair

        modules.append(intersection_repair)
    if relax or remesh or decimate:
        from dmc_cli.processing.relaxation import relaxation_kernels

        modules += relaxation_kernels()
    return modules
