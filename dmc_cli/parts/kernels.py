"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def kernel_modules(*, selects: bool) -> list[ModuleType]:
    """Return the modules whose kernels the stages need, for loading them ahead of time."""
    if not selects:
        return []
    from dmc_cli.parts import components, joining, runs

    return [joining, components, runs]
