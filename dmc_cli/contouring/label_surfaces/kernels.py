"""Name the modules with kernels of this folder, for loading them ahead of time."""

from types import ModuleType


def label_kernels() -> list[ModuleType]:
    """Return the modules whose kernels surfaces of labels need, those that take longest to compile first."""
    from dmc_cli.contouring.label_surfaces import (
        crossings,
        folds,
        links,
        net,
        pieces,
        shells,
        steps,
        swept_volumes,
    )
    from dmc_cli.field import slice_kernels

    return [shells, net, links, pieces, swept_volumes, steps, folds, crossings, *slice_kernels()]
