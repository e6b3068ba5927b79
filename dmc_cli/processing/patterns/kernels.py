"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def pattern_kernels() -> list[ModuleType]:
    """Return the modules whose kernels find and remove patterns."""
    from dmc_cli.processing.patterns import masks, removal_3x3y, simplify_3x3y, simplify_3333

    return [masks, simplify_3x3y, removal_3x3y, simplify_3333]
