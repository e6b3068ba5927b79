"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def remeshing_kernels() -> list[ModuleType]:
    """Return the modules whose kernels the rounds launch, but those of relaxation."""
    from dmc_cli.processing.remeshing import inheritance, mend, regions, sweep

    return [regions, sweep, mend, inheritance]
