"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def kernel_modules(*, finds: bool = False, reshapes: bool = False, filters: bool = False) -> list[ModuleType]:
    """Return the modules whose kernels the stages need, for loading them ahead of time.

    `finds` is for components, `reshapes` for opening and closing, `filters` for smoothing and resampling.
    """
    modules: list[ModuleType] = []
    if finds:
        from dmc_cli.parts import components, joining, runs

        modules += [joining, components, runs]
    if reshapes:
        from dmc_cli.parts import morphology

        modules.append(morphology)
    if filters:
        from dmc_cli.parts import blending

        modules.append(blending)
    return modules
