"""Say which labels of a map to make surfaces of."""

from dataclasses import dataclass, field

from dmc_cli.errors import SettingsError
from dmc_cli.requirements import MEASURE_FIGURES, settled_requirements
from dmc_cli.settings.checks import check_path, check_run
from dmc_cli.settings.conversion import MemoryShare
from dmc_cli.settings.mesh import MeshSettings
from dmc_cli.settings.output import OutputSettings
from dmc_cli.settings.part import PartSettings
from dmc_cli.settings.reading import ReadSettings
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class LabelSettings:
    """Which labels of a label map to make surfaces of, and where they go.

    `labels` are numbers or names, or `all`, which none means, too; `label_names` is a table of names and
    colours (ITK-SNAP, FreeSurfer, 3D Slicer, BIDS), where the input has none, or others. Without `conforming`
    each has a closed shell of its own: `output.path` is a template with `{label}` in it, or one file. With it
    all are one mesh, whose faces know the labels on both sides; it has no normals, since vertices where
    labels meet have several.

    `mesh` is the size of each shell: `quads` of each, `edge_length`, `max_error`; nothing else of it, and
    none of a conforming mesh. Shells that touch have vertices of their own then.

    `part` is of each label: its components, its cavities, what of it is thin. Nodes that it loses become
    background, and what it gains was background; resampling takes the label that most nodes have.
    """

    input: str
    output: OutputSettings
    labels: tuple[str, ...] = ()
    conforming: bool = False
    label_names: str | None = None
    read: ReadSettings = field(default_factory=ReadSettings)
    part: PartSettings = field(default_factory=PartSettings)
    mesh: MeshSettings = field(default_factory=MeshSettings)
    share: MemoryShare = field(default_factory=MemoryShare)
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("input", self.input)
        check_path("label_names", self.label_names)
        check_run(self.device, self.threads)
        if not all(word.strip() for word in self.labels):
            raise SettingsError(
                f"labels are {','.join(self.labels)!r:.80}; expected all, or numbers or names with commas"
                " between, as in 1,2,5"
            )
        if self.part.cut_table or self.part.smooth_volume is not None:
            raise SettingsError(
                "cut_table and smooth_volume are of values that measure something, and labels are names;"
                " leave them out with labels, whose surfaces are smooth as they are"
            )
        self._check_mesh()
        output = self.output
        others = (output.halfedges, output.marked, output.wall)
        if others != (None, None, None) or output.curvature or output.check or output.values:
            raise SettingsError(
                "halfedges, curvature, check, values, marked and wall are of a surface at an isovalue; leave"
                " them out with labels"
            )
        settled_requirements(output.require, MEASURE_FIGURES)
        if "on-surface" in output.require:
            raise SettingsError(
                "on-surface was required of labels, whose surfaces are at no isovalue; leave it out"
            )

    def _check_mesh(self) -> None:
        """Raise SettingsError if more is to be done to shells than to give them a size."""
        mesh, size = self.mesh, self.mesh.first_size
        sizes = MeshSettings(quads=mesh.quads, edge_length=mesh.edge_length, max_error=mesh.max_error)
        if mesh != sizes:
            raise SettingsError(
                "simplify, remesh, relax, project and repair_intersections are of a surface at an isovalue;"
                " leave them out with labels; quads, edge_length and max_error say of what size shells are"
            )
        if size is not None and self.conforming:
            raise SettingsError(
                f"{size} is {getattr(mesh, size)!r:.80}, but the labels share one mesh, whose quads stay as"
                " they are; leave one of the two out: shells of their own have a size"
            )
