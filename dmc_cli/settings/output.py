"""Say what to write where, and what must hold before it is written."""

from dataclasses import dataclass

from dmc_cli import mesh_formats
from dmc_cli.errors import SettingsError
from dmc_cli.requirements import CONVERT_FIGURES, looks_at, settled_requirements
from dmc_cli.settings.checks import check_format, check_marked, check_outputs, check_told_wall
from dmc_cli.settings.choices import STREAM, Element, MeshValue, OutputSpace, OutputUnit
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class OutputSettings:
    """What to write where, and what must hold before it is written.

    `path`, `halfedges` and `report` may be `-`, standard output, but only one of them. Without
    `output_format` the suffix of `path` chooses it. Without a word `normals` stand where the format has a
    place for them. `unit` is that of the coordinates, and so of area
    and volume; grid indices have none. `values` lists what stands beside each vertex or face in the file;
    `element` is what a quad is to a solver (S4R without it), a triangle what goes with that.
    `curvature` has the report tell that, too, `wall` how much of the area is thinner. `require` lists what
    the mesh must be, words and comparisons of `requirements.py`; `marked` is a file for the mesh with what
    each face is to blame for; `check` verifies every invariant of the result; `dry_run` does everything but
    write the mesh; `memory` is the budget in bytes that the forecast is held against.
    """

    path: str
    output_format: str | None = None
    normals: bool | None = None
    space: OutputSpace = "native"
    unit: OutputUnit = "mm"
    ascii: bool = False
    values: tuple[MeshValue, ...] = ()
    element: Element | None = None
    force: bool = False
    allow_empty: bool = False
    halfedges: str | None = None
    report: str | None = None
    curvature: bool = False
    wall: float | None = None
    require: tuple[str, ...] = ()
    marked: str | None = None
    check: bool = False
    dry_run: bool = False
    memory: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_format("output_format", self.output_format, mesh_formats.FORMATS)
        object.__setattr__(self, "require", settled_requirements(self.require, CONVERT_FIGURES))
        if self.memory is not None and self.memory < 1:
            raise SettingsError(f"memory is {self.memory} bytes; expected a positive number")
        if self.space == "voxel" and self.unit != "mm":
            raise SettingsError(
                f"unit is {self.unit!r}, but space is 'voxel': grid indices have no unit; leave one out"
            )
        outputs = {"mesh": self.path, "halfedges": self.halfedges, "report": self.report}
        check_outputs({**outputs, "marked mesh": self.marked}, STREAM)
        check_marked(self.marked, self.require)
        check_told_wall(self.wall, is_told=self.report is not None or bool(self.require))
        if self.curvature and self.report is None:
            raise SettingsError(
                "curvature was asked for, but no report that tells it; name one with --report"
            )

    @property
    def has_normals(self) -> bool:
        """Return whether the mesh's file gets normals."""
        return has_normals(self.normals, self.path, self.output_format)

    @property
    def is_measured(self) -> bool:
        """Return whether the mesh's measures are needed: for a report, a requirement or a check."""
        return self.report is not None or bool(self.require) or self.check

    @property
    def finds_intersections(self) -> bool:
        """Return whether the mesh's intersections are counted: for a report or a requirement."""
        required = looks_at("quality.self_intersections", self.require, CONVERT_FIGURES)
        return self.report is not None or required

    @property
    def measures_thickness(self) -> bool:
        """Return whether walls are measured: against a length, or for a requirement."""
        return self.wall is not None or looks_at("thickness.", self.require, CONVERT_FIGURES)

    @property
    def finds_curvature(self) -> bool:
        """Return whether the mesh's curvature is measured: for a report that tells it or a requirement."""
        return self.curvature or looks_at("curvature.", self.require, CONVERT_FIGURES)


def has_normals(asked: bool | None, path: str, output_format: str | None) -> bool:
    """Return whether a mesh's file gets normals: as is asked, else where its format has a place for them."""
    if asked is not None:
        return asked
    name = output_format or mesh_formats.format_by_suffix(path)
    return name is None or mesh_formats.FORMATS[name].holds_normals
