"""List the methods of contouring: a folder each, and a line here."""

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from dmc_cli.contouring import dual_marching_cubes
from dmc_cli.contouring.surface import Surface
from dmc_cli.settings import PlacementRule


@dataclass(frozen=True, kw_only=True)
class Method:
    """How a method is called.

    Attributes:
        title: Its name in words.
        extract: From a volume on a device to a surface; `extract_surface` says what it takes and raises.
        connect: From that surface to one whose mesh has halfedges.
        color: From a connected surface to one whose quads are coloured.
        kernels: The modules whose kernels `extract` needs, those that take longest to compile first.
        mesh_kernels: The modules that `connect` needs and, if colours are wanted, `color`.
    """

    title: str
    extract: Callable[..., Surface]
    connect: Callable[[Surface], Surface]
    color: Callable[[Surface], Surface]
    kernels: Callable[[PlacementRule], list[ModuleType]]
    mesh_kernels: Callable[..., list[ModuleType]]


METHODS = {
    "dmc": Method(
        title="dual marching cubes",
        extract=dual_marching_cubes.extract,
        connect=dual_marching_cubes.connect,
        color=dual_marching_cubes.color,
        kernels=dual_marching_cubes.kernels,
        mesh_kernels=dual_marching_cubes.mesh_kernels,
    ),
}
"""Each method by the word that `--method` has for it."""
