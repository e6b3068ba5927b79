"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def slice_kernels() -> list[ModuleType]:
    """Return the modules whose kernels map vertices between unevenly spaced slices."""
    from dmc_cli.field import slices

    return [slices]
