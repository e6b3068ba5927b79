"""Register the methods of contouring: a folder of `contouring/` each, and a line here.

A folder declares its method in a file that imports no Warp. So the settings are held against what a method
takes, and `--help` and error messages tell it, before anything of the method is loaded; its functions are
imported when they are first called.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from pkgutil import resolve_name
from types import ModuleType
from typing import Any, Literal

from dmc_cli.errors import SettingsError

METHODS = {
    "dmc": "dmc_cli.contouring.dual_marching_cubes:METHOD",
    "mc": "dmc_cli.contouring.marching_cubes:METHOD",
    "tmc": "dmc_cli.contouring.topological_marching_cubes:METHOD",
    "nets": "dmc_cli.contouring.surface_nets:METHOD",
    "dc": "dmc_cli.contouring.dual_contouring:METHOD",
    "macet": "dmc_cli.contouring.macet:METHOD",
}
"""Each method by its name, as `--method` takes it: where it is declared."""


@dataclass(frozen=True)
class Cost:
    """Bytes of arrays per row, word of 32 nodes, word near the surface, listed cell, vertex and face.

    A listed cell is one of which a record is kept.
    """

    row: int = 0
    word: int = 0
    near: int = 0
    cell: int = 0
    vertex: int = 0
    face: int = 0

    def __add__(self, other: "Cost") -> "Cost":
        """Return what both take together."""
        return Cost(*(getattr(self, part.name) + getattr(other, part.name) for part in fields(self)))


@dataclass(frozen=True, kw_only=True)
class Memory:
    """What a method's arrays take beside the volume and the mesh.

    Attributes:
        cells: Bits and records of nodes and cells, known before any vertex is placed.
        extracting: What comes to these while vertices and faces are made.
        connecting: All that is there while the faces are connected, the halfedges apart; if nothing is told,
            what connecting any mesh takes: counts, starts and ends of lists of halfedges, and the lists.
    """

    cells: Cost = field(default_factory=Cost)
    extracting: Cost = field(default_factory=Cost)
    connecting: Cost = field(default_factory=lambda: Cost(vertex=8 + 8 + 8, face=16))


@dataclass(frozen=True, kw_only=True)
class Number:
    """A number that some placements of a method take.

    Attributes:
        default: What it is where none is given.
        least: The least that it may be.
        most: The most that it may be.
        why: Why not less or more, in words.
        placements: The placements that take it.
    """

    default: float
    least: float
    most: float
    why: str
    placements: frozenset[str | None]


@dataclass(frozen=True, kw_only=True)
class Method:
    """A method of contouring: what it makes, what it takes, and where its functions are.

    Attributes:
        title: Its name in words.
        faces: What its faces are.
        options: The options of `SurfaceSettings` that not every method has, as far as it has them: the
            values that it takes, its default first.
        numbers: The numbers of `SurfaceSettings` that it takes.
        on_surface: Placements whose vertices lie on the trilinear surface; None among them where vertices do
            that without a choice of placements.
        manifold: Topologies whose meshes are 2-manifolds, with boundary where the volume cuts them; None
            among them where that holds without a choice of topologies. All promise vertices in their cells,
            faces that look the way that is asked, twins between faces that share an edge; others no more.
        extract: From a volume on a device to a surface; `extract_surface` says what it takes and raises.
        kernels: From `SurfaceSettings` to the modules whose kernels `extract` launches, those that take
            longest to compile first.
        connect: From that surface to one whose mesh has halfedges; None if any mesh's way serves.
        color: From a connected surface to one whose faces are coloured; None if they have no colours.
        mesh_kernels: The modules that `connect` needs and, with `colors=True`, `color`; None without either.
        list_tunnels: From a volume on a device and `SurfaceSettings` to the cells in which the trilinear
            surface has a tunnel, int64 (n, 3); None if the method does not form them.
        list_flips: From the same to the faces that it decides otherwise, to be a manifold, int64 (n, 4): a
            cell, and the axis of its high face; None if it leaves all as they are.
        memory: What its arrays take.
    """

    title: str
    faces: Literal["quads", "triangles"]
    options: Mapping[str, tuple[str, ...]]
    on_surface: frozenset[str | None]
    extract: Callable[..., Any]
    kernels: Callable[[Any], list[ModuleType]]
    connect: Callable[[Any], Any] | None = None
    color: Callable[[Any], Any] | None = None
    mesh_kernels: Callable[..., list[ModuleType]] | None = None
    list_tunnels: Callable[..., Any] | None = None
    list_flips: Callable[..., Any] | None = None
    memory: Memory = field(default_factory=Memory)
    manifold: frozenset[str | None] = frozenset()
    numbers: Mapping[str, Number] = field(default_factory=dict)


def method_named(name: str) -> Method:
    """Return the method of that name.

    Raises:
        SettingsError: There is none.
    """
    if name not in METHODS:
        raise SettingsError(f"method is {name!r:.80}; expected one of {', '.join(METHODS)}")
    found: Method = resolve_name(METHODS[name])
    return found


def later(place: str) -> Callable[..., Any]:
    """Return a function that imports the one at a place, `module:function`, when it is called."""

    def call(*arguments: Any, **named: Any) -> Any:
        return resolve_name(place)(*arguments, **named)

    return call


def settled_option(method: str, option: str, given: str | None) -> str | None:
    """Return the value of an option as a method takes it: its own default where none was given.

    Raises:
        SettingsError: The method has no such option, or does not take that value.
    """
    taken = method_named(method).options.get(option, ())
    if given is None:
        return taken[0] if taken else None
    if not taken:
        raise SettingsError(
            f"{option} is {given!r:.80}, but the method {method} has no such option; leave it out, or choose"
            f" a method that has it: {', '.join(methods_that(lambda other: option in other.options))}"
        )
    if given not in taken:
        raise SettingsError(
            f"{option} is {given!r:.80}; expected one of {', '.join(taken)} with the method {method}"
        )
    return given


def settled_number(method: str, placement: str | None, name: str, given: float | None) -> float | None:
    """Return a number as a method's placement takes it: its own default where none was given.

    Raises:
        SettingsError: The placement takes no such number, or not that one.
    """
    taken = method_named(method).numbers.get(name)
    if taken is None or placement not in taken.placements:
        if given is None:
            return None
        found = f"the placement {placement} of the method {method}" if placement else f"the method {method}"
        raise SettingsError(
            f"{name} is {given:g}, but {found} takes none; leave it out, or choose {_placements_with(name)}"
        )
    if given is None:
        return taken.default
    if not taken.least <= given <= taken.most:
        raise SettingsError(f"{name} is {given:g}; expected {taken.least:g} to {taken.most:g}: {taken.why}")
    return given


def _placements_with(name: str) -> str:
    """Return the options that choose a placement with a number."""
    numbers = {method: method_named(method).numbers.get(name) for method in METHODS}
    return " or ".join(
        f"--method {method} --placement {placement}"
        for method, number in numbers.items()
        for placement in sorted(filter(None, number.placements if number else ()))
    )


def methods_that(hold: Callable[[Method], bool]) -> list[str]:
    """Return the names of the methods for which something holds."""
    return [name for name in METHODS if hold(method_named(name))]


def option_values(option: str) -> tuple[str, ...]:
    """Return the values that an option has with any method, in the order of the registry."""
    values = [value for name in METHODS for value in method_named(name).options.get(option, ())]
    return tuple(dict.fromkeys(values))
