"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def launch_kernels() -> list[ModuleType]:
    """Return the modules with the kernels that launches themselves need."""
    from dmc_cli.runtime import job_slots, prefix_sums

    return [job_slots, prefix_sums]
