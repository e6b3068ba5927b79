"""Say what becomes of a surface's quads."""

import math
from dataclasses import dataclass

from dmc_cli.errors import SettingsError
from dmc_cli.settings.choices import Simplify, SimplifyRules
from dmc_cli.settings.types import is_whole, settle_types

SIZES = ("quads", "edge_length", "max_error")
"""Settings that have quads taken away."""

_ON_FIELD = ("remesh", "relax", "simplify")
"""Settings that have quads changed on the surface of a field, one that implies another before it."""


@dataclass(frozen=True, kw_only=True)
class MeshSettings:
    """What becomes of the surface's quads; `project` puts vertices that have moved back on the surface.

    `remesh` is the number of rounds of remeshing, which implies the simplification by all patterns; `quads`
    how many to leave then, a number or a share as in "25%"; `edge_length` leaves as many as sides of so many
    mm make of the area instead. `max_error` is how many mm the mesh may be from the one before quads were
    taken away, everywhere and both ways; alone it leaves as few as that lets. `relax` is the number of steps
    of smoothing on the surface, at last. `repair_intersections` has faces that intersect pulled apart;
    without a word, where quads were changed by other than the papers' bare rules, or where it is required
    that there are none.
    """

    simplify: Simplify = "none"
    simplify_rules: SimplifyRules = "safe"
    project: bool = True
    remesh: int = 0
    quads: str | int | None = None
    edge_length: float | None = None
    max_error: float | None = None
    relax: int = 0
    repair_intersections: bool | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        if is_whole(self.quads):
            object.__setattr__(self, "quads", str(self.quads))
        settle_types(self)
        if self.quads is not None:
            wanted_quads(str(self.quads), 0)
        self._check_sizes()
        if self.remesh < 0:
            raise SettingsError(f"remesh is {self.remesh}; expected a number of rounds, 0 or more")
        if self.relax < 0:
            raise SettingsError(f"relax is {self.relax}; expected a number of steps, 0 or more")
        if self.remesh:
            self._settle_remeshing()

    def _check_sizes(self) -> None:
        """Raise SettingsError if a size is none, or what comes before leaves no mesh on the surface."""
        for name in ("edge_length", "max_error"):
            length = getattr(self, name)
            if length is not None and not 0 < length < math.inf:
                raise SettingsError(f"{name} is {length}; expected a positive length in mm")
        if self.quads is not None and self.edge_length is not None:
            raise SettingsError(
                f"quads is {self.quads!r:.80} and edge_length is {self.edge_length:g}; expected one of them,"
                " since either says how many quads are left"
            )
        size, off_surface = self.first_size, self._off_surface
        if size is not None and self.simplify != "none" and off_surface is not None:
            raise SettingsError(
                f"{size} is {getattr(self, size)!r:.80}, but {off_surface}; expected the safe rules and"
                " vertices on the surface, which collapses rely on"
            )

    def _settle_remeshing(self) -> None:
        """Raise SettingsError if remeshing cannot follow; set the simplification that it implies."""
        off_surface = self._off_surface
        if off_surface is not None:
            raise SettingsError(
                f"remesh is {self.remesh}, but {off_surface}; expected the safe rules and vertices on the"
                " surface, which its operations rely on"
            )
        if self.simplify not in ("none", "all"):
            raise SettingsError(
                f"remesh is {self.remesh}, but simplify is {self.simplify!r}; expected 'all', which remeshing"
                " implies, or leave it out"
            )
        object.__setattr__(self, "simplify", "all")

    @property
    def _off_surface(self) -> str | None:
        """Return what keeps vertices of a simplified mesh from lying on the surface, None if nothing does."""
        if self.simplify_rules == "paper":
            return "simplify_rules is 'paper'"
        return None if self.project else "project is off"

    @property
    def first_size(self) -> str | None:
        """Return the name of the first setting that has quads taken away, None if there is none."""
        return next((name for name in SIZES if getattr(self, name) is not None), None)

    @property
    def first_change(self) -> str | None:
        """Return the name of the first setting that has quads changed, None if there is none."""
        return self.first_on_field or self.first_size

    @property
    def first_on_field(self) -> str | None:
        """Return the name of the first setting that needs the field whose surface the quads are."""
        default = MeshSettings()
        return next((name for name in _ON_FIELD if getattr(self, name) != getattr(default, name)), None)

    @property
    def follows_paper(self) -> bool:
        """Return whether the mesh is simplified by the papers' bare rules, which promise nothing."""
        return self.simplify != "none" and self.simplify_rules == "paper"

    @property
    def is_changed(self) -> bool:
        """Return whether vertices or quads do not stay as the surface has them."""
        return self.first_change is not None


def wanted_quads(given: str, count: int) -> int:
    """Return how many of `count` quads to leave, given a number or a share as in "25%".

    Raises:
        SettingsError: It is neither.
    """
    number, is_share = given.strip(), given.strip().endswith("%")
    try:
        value = float(number.rstrip("%")) if is_share else int(number)
    except ValueError:
        value = -1
    if not (0 < value < 100 if is_share else value > 0):
        raise SettingsError(
            f"quads is {given!r:.80}; expected a number of quads from 1 on, or a share under 100 %, as in"
            " 20000 or 25%"
        )
    return max(1, round(count * value / 100)) if is_share else int(value)


def repairs(mesh: MeshSettings, require: tuple[str, ...]) -> bool:
    """Return whether faces that intersect are pulled apart.

    They are where that is asked for, else where a stage moves vertices or takes quads away, or where it is
    required that none intersect. The papers' bare rules stay what they are.
    """
    if mesh.repair_intersections is not None:
        return mesh.repair_intersections
    is_required = "no-self-intersections" in require or "print" in require
    return is_required or (mesh.is_changed and not mesh.follows_paper)
