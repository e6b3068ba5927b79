"""List the methods of contouring: a folder each, and a line here."""

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

from dmc_cli.contouring import dual_marching_cubes
from dmc_cli.mesh.surface import Surface
from dmc_cli.settings import Placement


@dataclass(frozen=True)
class Method:
    """How a method is called.

    Attributes:
        title: Its name in words.
        extract: From a volume on a device to a surface; `extract_surface` says what it takes and raises.
        kernels: The modules whose kernels it needs, those that take longest to compile first.
    """

    title: str
    extract: Callable[..., Surface]
    kernels: Callable[[Placement], list[ModuleType]]


METHODS = {
    "dmc": Method("dual marching cubes", dual_marching_cubes.extract, dual_marching_cubes.kernels),
}
"""Each method by the word that `--method` has for it."""
