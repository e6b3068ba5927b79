"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def selection_kernels() -> list[ModuleType]:
    """Return the modules whose kernels make and keep lists of items."""
    from dmc_cli.bits import selection

    return [selection]
