"""Say what to do to a file's mesh."""

from dataclasses import dataclass, field

from dmc_cli import mesh_formats
from dmc_cli.errors import SettingsError
from dmc_cli.requirements import MESH_FIGURES, looks_at, settled_requirements
from dmc_cli.settings.checks import (
    check_format,
    check_marked,
    check_outputs,
    check_path,
    check_reference,
    check_run,
    check_told_wall,
)
from dmc_cli.settings.choices import STREAM, Element, Inside, MeshSpace, MeshValue, OutputUnit
from dmc_cli.settings.mesh import MeshSettings
from dmc_cli.settings.output import has_normals
from dmc_cli.settings.reading import ReadSettings
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class ReworkSettings:
    """What to do to the mesh of a file, and where to write it.

    `keep` is how many components stay, those with most faces; `min_faces` the fewest faces of one that stays;
    `flip` turns all faces round. What `operations` do needs quads, and all but a size and repair the volume
    and isovalue that the mesh was made of, `inside` being the side that was the object. `unit` and `space`
    are those of the file unless others are named. Outputs are those of `OutputSettings`.
    """

    mesh: str
    path: str
    keep: int | None = None
    min_faces: int = 0
    flip: bool = False
    operations: MeshSettings = field(default_factory=MeshSettings)
    volume: str | None = None
    isovalue: float | None = None
    inside: Inside = "above"
    read: ReadSettings = field(default_factory=ReadSettings)
    unit: OutputUnit | None = None
    space: MeshSpace = "native"
    normals: bool | None = None
    output_format: str | None = None
    ascii: bool = False
    values: tuple[MeshValue, ...] = ()
    element: Element | None = None
    force: bool = False
    report: str | None = None
    require: tuple[str, ...] = ()
    marked: str | None = None
    wall: float | None = None
    dry_run: bool = False
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("mesh", self.mesh)
        check_path("volume", self.volume)
        check_outputs({"mesh": self.path, "report": self.report, "marked mesh": self.marked}, STREAM)
        check_marked(self.marked, self.require)
        check_told_wall(self.wall, is_told=self.is_measured)
        object.__setattr__(self, "require", settled_requirements(self.require, MESH_FIGURES))
        check_format("output_format", self.output_format, mesh_formats.FORMATS)
        check_run(self.device, self.threads)
        if self.keep is not None and self.keep < 1:
            raise SettingsError(f"keep is {self.keep}; expected how many components stay, 1 or more")
        if self.min_faces < 0:
            raise SettingsError(f"min_faces is {self.min_faces}; expected a number of faces, 0 or more")
        check_reference(self.volume, self.isovalue)
        if "deviation" in self.values and self.volume is None:
            raise SettingsError(
                "values has 'deviation', but no volume was given to hold the mesh against; name it with"
                " --volume and -i"
            )
        name = self.operations.first_on_field
        if name is not None and self.volume is None:
            raise SettingsError(
                f"{name} is {getattr(self.operations, name)!r}, but no volume was given, on whose isosurface"
                " the vertices are kept; name it with --volume and -i"
            )
        if self.operations.follows_paper:
            raise SettingsError(
                "simplify_rules is 'paper', by the colours of the grid, which files of meshes lack; expected"
                " 'safe'; leave it out"
            )

    @property
    def has_normals(self) -> bool:
        """Return whether the mesh's file gets normals."""
        return has_normals(self.normals, self.path, self.output_format)

    @property
    def is_measured(self) -> bool:
        """Return whether the mesh's measures are needed: for a report or a requirement."""
        return self.report is not None or bool(self.require)

    @property
    def measures_thickness(self) -> bool:
        """Return whether walls are measured: against a length, or for a requirement."""
        return self.wall is not None or looks_at("thickness.", self.require, MESH_FIGURES)
