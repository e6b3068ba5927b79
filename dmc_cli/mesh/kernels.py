"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def connecting_kernels() -> list[ModuleType]:
    """Return the modules whose kernels connect the faces of any mesh."""
    from dmc_cli.mesh import connectivity, twins

    return [twins, connectivity]


def changing_kernels() -> list[ModuleType]:
    """Return the modules whose kernels a stage that removes faces needs."""
    from dmc_cli.mesh import compaction, valences

    return [compaction, valences]


def tree_kernels() -> list[ModuleType]:
    """Return the modules whose kernels make a tree of boxes over a mesh."""
    from dmc_cli.mesh import box_tree

    return [box_tree]
