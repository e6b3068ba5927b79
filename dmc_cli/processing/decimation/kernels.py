"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def decimation_kernels() -> list[ModuleType]:
    """Return the modules whose kernels the rounds launch, but those of remeshing."""
    from dmc_cli.processing.decimation import costs, points, sizes, sweep

    return [costs, points, sizes, sweep]
