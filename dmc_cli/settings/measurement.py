"""Say which mesh to measure."""

import math
from dataclasses import dataclass, field

from dmc_cli.errors import SettingsError
from dmc_cli.requirements import MEASURE_FIGURES, looks_at, settled_requirements
from dmc_cli.settings.checks import (
    check_marked,
    check_outputs,
    check_path,
    check_reference,
    check_run,
    check_wall,
)
from dmc_cli.settings.choices import STREAM, Inside
from dmc_cli.settings.reading import ReadSettings
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class MeasureSettings:
    """Which mesh file to measure; `volume` and `isovalue`, both or neither, are what it is held against.

    `inside` is the side that was the object when the mesh was made with a closed border. `against` is another
    mesh that the distance is measured to, by `density` samples on a unit of area. `thickness` has that of
    walls measured; so has `wall`, a length in the mesh's unit, with how much is thinner. `require` lists what
    the mesh must be, words and comparisons of `requirements.py`; `marked` is a file for the mesh with what
    each face is to blame for, which `force` overwrites.
    """

    mesh: str
    volume: str | None = None
    isovalue: float | None = None
    inside: Inside = "above"
    curvature: bool = False
    against: str | None = None
    density: float | None = None
    thickness: bool = False
    wall: float | None = None
    require: tuple[str, ...] = ()
    marked: str | None = None
    force: bool = False
    read: ReadSettings = field(default_factory=ReadSettings)
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("mesh", self.mesh)
        check_path("volume", self.volume)
        check_path("against", self.against)
        check_outputs({"marked mesh": self.marked, "report": STREAM}, STREAM)
        check_marked(self.marked, self.require)
        object.__setattr__(self, "require", settled_requirements(self.require, MEASURE_FIGURES))
        if self.density is not None and not 0 < self.density < math.inf:
            raise SettingsError(f"density is {self.density}; expected a positive number of samples")
        check_wall(self.wall)
        if self.density is not None and self.against is None:
            raise SettingsError(
                f"density {self.density:g} was given, but no other mesh; name one that the distance is to be"
                " measured to with --against"
            )
        check_run(self.device, self.threads)
        check_reference(self.volume, self.isovalue)

    @property
    def measures_thickness(self) -> bool:
        """Return whether walls are measured: because it was asked for or for a requirement."""
        asked = self.thickness or self.wall is not None
        return asked or looks_at("thickness.", self.require, MEASURE_FIGURES)

    @property
    def finds_curvature(self) -> bool:
        """Return whether the curvature is measured: because it was asked for or for a requirement."""
        return self.curvature or looks_at("curvature.", self.require, MEASURE_FIGURES)
