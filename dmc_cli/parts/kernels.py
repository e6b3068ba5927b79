"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def kernel_modules(
    *, finds: bool = False, reshapes: bool = False, filters: bool = False, labels: bool = False
) -> list[ModuleType]:
    """Return the modules whose kernels the stages need, for loading them ahead of time.

    `finds` is for components, `reshapes` for opening and closing, `filters` for smoothing and
    resampling, `labels` for components of labels.
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
    if labels:
        from dmc_cli.parts import label_runs

        modules.append(label_runs)
    return modules
