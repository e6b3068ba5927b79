"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def relaxation_kernels() -> list[ModuleType]:
    """Return the modules whose kernels move vertices and check their steps."""
    from dmc_cli.processing.relaxation import step_checks, steps

    return [steps, step_checks]
