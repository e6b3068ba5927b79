"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def remeshing_kernels() -> list[ModuleType]:
    """Return the modules whose kernels the rounds launch, but those of regions and of relaxation."""
    from dmc_cli.processing.remeshing import inheritance, mend, sweep, warp_accounts

    return [sweep, mend, inheritance, warp_accounts]


def region_kernels() -> list[ModuleType]:
    """Return the modules whose kernels divide a mesh into regions."""
    from dmc_cli.processing.remeshing import regions

    return [regions]
