"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType

from dmc_cli.contouring.registry import METHODS
from dmc_cli.settings import Method, PlacementRule


def kernel_modules(
    *, normals_too: bool = True, method: Method = "dmc", placement: PlacementRule = "exact"
) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, for loading them ahead of time.

    The one that takes longest to compile comes first, so that it is not the last to be ready.
    """
    from dmc_cli.contouring import normals

    modules = METHODS[method].kernels(placement)
    return [normals, *modules] if normals_too else modules


def mesh_kernel_modules(*, method: Method = "dmc", colors: bool = False) -> list[ModuleType]:
    """Return the modules whose kernels connecting the faces needs, and colouring them if that is wanted."""
    modules = METHODS[method].mesh_kernels(colors=colors)
    if colors:
        from dmc_cli.contouring import vertex_colors

        modules.append(vertex_colors)
    return modules
