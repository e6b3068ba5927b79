"""Say which surface to extract."""

import math
from dataclasses import dataclass

from dmc_cli.errors import CallError, SettingsError
from dmc_cli.isovalue_choices import parse_choice
from dmc_cli.methods import method_named, settled_number, settled_option
from dmc_cli.settings.choices import (
    METHOD_NUMBERS,
    METHOD_OPTIONS,
    Border,
    Gradients,
    Inside,
    Orientation,
    Topology,
    Triangulation,
)
from dmc_cli.settings.types import settle_types


def check_isovalue(isovalue: float | str | None) -> None:
    """Raise SettingsError unless an isovalue is a finite number or a way to choose one."""
    if not isinstance(isovalue, float):
        parse_choice(isovalue)
    elif not math.isfinite(isovalue):
        raise SettingsError(f"isovalue is {isovalue}; expected a finite number")


@dataclass(frozen=True, kw_only=True)
class SurfaceSettings:
    """Which surface to extract from a volume.

    `isovalue` is a number in the volume's physical values, or how it is chosen (`otsu`, `20%`, `bone`,
    `band:150:300`; None: by what the volume is), which a conversion settles once it has read the volume.
    Topology, placement, triangulation, border and gradients are what the method takes of them: its own
    default where none is given, None where it has no such option. So are `steps` and `step_size`, of
    placements that move by steps.
    """

    isovalue: float | str | None = None
    method: str = "dmc"
    inside: Inside = "above"
    topology: Topology | None = None
    placement: str | None = None
    triangulation: Triangulation | None = None
    border: Border | None = None
    orientation: Orientation = "outward"
    gradients: Gradients | None = None
    steps: int | None = None
    step_size: float | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door, and what the method takes."""
        settle_types(self)
        check_isovalue(self.isovalue)
        for option in METHOD_OPTIONS:
            object.__setattr__(self, option, settled_option(self.method, option, getattr(self, option)))
        for name in METHOD_NUMBERS:
            number = settled_number(self.method, self.placement, name, getattr(self, name))
            object.__setattr__(self, name, number)

    @property
    def settled_isovalue(self) -> float:
        """Return the isovalue as a number.

        Raises:
            CallError: It is still to be chosen.
        """
        if not isinstance(self.isovalue, float):
            raise CallError(
                f"isovalue is {self.isovalue!r}, which depends on the volume; expected a number here; convert"
                " chooses it, or give one"
            )
        return self.isovalue

    @property
    def is_on_surface(self) -> bool:
        """Return whether vertices are placed on the trilinear surface."""
        return self.placement in method_named(self.method).on_surface

    @property
    def is_manifold(self) -> bool:
        """Return whether the mesh is promised to be a 2-manifold."""
        return self.topology in method_named(self.method).manifold
