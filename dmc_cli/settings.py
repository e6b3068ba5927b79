"""Define every choice that a user can make, with its default: here and nowhere else.

The command line builds these dataclasses from its options (a test keeps both sides equal); the
Python API takes them as they are. Settings are immutable and hold plain values only.
"""

import math
from dataclasses import dataclass, field
from typing import Any, Literal

from dmc_cli import mesh_formats, volume_formats
from dmc_cli.crops import parse_crop
from dmc_cli.errors import CallError, SettingsError
from dmc_cli.isovalue_choices import parse_choice
from dmc_cli.methods import METHODS, method_named, methods_that, settled_number, settled_option
from dmc_cli.requirements import (
    CONVERT_FIGURES,
    MEASURE_FIGURES,
    MESH_FIGURES,
    looks_at,
    settled_requirements,
)
from dmc_cli.setting_checks import (
    check_format,
    check_noise,
    check_outputs,
    check_path,
    check_reference,
    check_run,
    check_threads,
)
from dmc_cli.setting_types import is_whole, settle_types

ByteOrder = Literal["little", "big"]
SliceGaps = Literal["refuse", "keep"]
Duplicates = Literal["refuse", "first"]
SliceOrder = Literal["position", "instance", "location", "filename"]
Inside = Literal["above", "below"]
Topology = Literal["manifold", "asymptotic"]
Border = Literal["open", "closed"]
Triangulation = Literal["best", "standard"]
Gradients = Literal["differences", "exact"]
Simplify = Literal["none", "3x3y", "3333", "all"]
SimplifyRules = Literal["safe", "paper"]
Orientation = Literal["outward", "gradient"]
OutputSpace = Literal["native", "ras", "lps", "voxel"]
MeshSpace = Literal["native", "ras", "lps"]
OutputUnit = Literal["mm", "um", "nm", "m"]
SyntheticField = Literal[
    "genus_two", "iwp", "neovius", "kummer", "steiner", "sphere", "torus", "box", "csg", "noise"
]
VolumeFormat = Literal["nifti", "nrrd", "meta", "raw"]
PaperTable = Literal["2", "3", "4", "5", "6", "7", "8", "9", "I"]

Element = Literal["S4R", "S4", "M3D4", "SFM3D4", "R3D4"]
MeshValue = Literal["quality", "deviation", "valence", "thickness"]

FACE_VALUES = ("quality",)
"""Values that a face has; the others are values of a vertex."""

METHOD_OPTIONS = ("topology", "placement", "triangulation", "border", "gradients")
"""Options of the surface that a method has or has not."""

METHOD_NUMBERS = ("steps", "step_size")
"""Numbers of the surface that a placement of a method takes or not."""

SIMPLIFIED = "+simplify"
"""What stands behind a method that is compared with its quads simplified."""


STREAM = "-"
"""The path that means standard input or standard output."""


def check_isovalue(isovalue: float | str | None) -> None:
    """Raise SettingsError unless an isovalue is a finite number or a way to choose one."""
    if not isinstance(isovalue, float):
        parse_choice(isovalue)
    elif not math.isfinite(isovalue):
        raise SettingsError(f"isovalue is {isovalue}; expected a finite number")


@dataclass(frozen=True, kw_only=True)
class ReadSettings:
    """How to read the input; what a format does not need is ignored, with a warning.

    `shape`, `spacing` and `origin` are in the order x, y, z; millimetres; the origin is the centre
    of the first node. Spacing and origin are for files that tell none, or a spacing in no known unit; without
    them they are 1 and 0.
    `allow_outside` reads files outside the input's own folder that a header or a link leads to.
    `strict` refuses files that leave open what they mean: every warning of `notices.ABOUT_MEANING`.
    `channel` and `time` are numbers from 0, or names of the file; `volume_index` counts what they leave.
    `seed` and `sigma` belong to the synthetic noise.
    """

    input_format: str | None = None
    shape: tuple[int, int, int] | None = None
    dtype: str | None = None
    byte_order: ByteOrder = "little"
    skip_bytes: int = 0
    spacing: tuple[float, float, float] | None = None
    origin: tuple[float, float, float] | None = None
    series: str | None = None
    slice_gaps: SliceGaps = "refuse"
    duplicates: Duplicates = "refuse"
    slice_order: SliceOrder = "position"
    channel: str | None = None
    time: str | None = None
    volume_index: int | None = None
    allow_outside: bool = False
    strict: bool = False
    seed: int = 0
    sigma: float = 0.0
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_format("input_format", self.input_format, volume_formats.FORMATS)
        if self.shape is not None and any(n < 1 for n in self.shape):
            raise SettingsError(f"shape is {self.shape}; expected three positive numbers of nodes")
        if self.spacing is not None and not all(math.isfinite(s) and s > 0 for s in self.spacing):
            raise SettingsError(f"spacing is {self.spacing}; expected three positive lengths in mm")
        if self.origin is not None and not all(math.isfinite(x) for x in self.origin):
            raise SettingsError(f"origin is {self.origin}; expected three finite coordinates in mm")
        if self.skip_bytes < 0:
            raise SettingsError(f"skip_bytes is {self.skip_bytes}; expected 0 or more")
        check_noise(self.seed, self.sigma)
        check_threads(self.threads)


@dataclass(frozen=True, kw_only=True)
class SynthSettings:
    """Which synthetic volume to write where; without `output_format` the suffix of `path` chooses it."""

    field: SyntheticField
    path: str
    nodes: int = 64
    output_format: VolumeFormat | None = None
    seed: int = 0
    sigma: float = 0.0
    force: bool = False

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("output", self.path)
        if not self.path:
            raise SettingsError("the output's name is empty; expected a file's name; give one")
        if self.nodes < 2:
            raise SettingsError(f"nodes is {self.nodes}; expected at least 2 along each axis")
        check_noise(self.seed, self.sigma)


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


def _is_positive(text: str | None) -> bool:
    """Return whether a text is a positive number."""
    try:
        return 0 < float(text or "") < math.inf
    except ValueError:
        return False


@dataclass(frozen=True, kw_only=True)
class PartSettings:
    """Which part of the volume is wanted, on its nodes before contouring; the stages follow each other so.

    `crop` keeps a box of nodes: for x, y and z `first:last`, both kept, in nodes, `mm` of the volume's space
    or `%` of its extent, as in `10:200,:,25%:75%`. `cut_table` takes away what a scan's body lies on.
    `resample` takes nodes at another distance in mm, or `isotropic`; `smooth_volume` is the standard
    deviation of a Gaussian in mm. Of the object, `open_gaps` takes away what is thinner than so many mm,
    `close_gaps` fills gaps that are narrower. `keep` keeps the `largest` component of it, or so many;
    `min_volume` those of at least so many mm3. `fill_cavities` fills what the object encloses: `all`, or
    cavities of at most so many mm3.
    """

    crop: str | None = None
    cut_table: bool = False
    resample: str | None = None
    smooth_volume: float | None = None
    open_gaps: float | None = None
    close_gaps: float | None = None
    keep: str | None = None
    min_volume: float | None = None
    fill_cavities: str | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        for name in ("resample", "keep", "fill_cavities"):
            given = getattr(self, name)
            if isinstance(given, int | float) and not isinstance(given, bool):
                object.__setattr__(self, name, f"{given:g}")
        settle_types(self)
        if self.crop is not None:
            parse_crop(self.crop)
        self.most_kept  # noqa: B018 - which checks it
        self.largest_cavity  # noqa: B018
        if self.min_volume is not None and not 0 < self.min_volume < math.inf:
            raise SettingsError(f"min_volume is {self.min_volume}; expected a positive volume in mm3")
        for name in ("smooth_volume", "open_gaps", "close_gaps"):
            length = getattr(self, name)
            if length is not None and not 0 < length < math.inf:
                raise SettingsError(f"{name} is {length}; expected a positive length in mm")
        if self.resample not in (None, "isotropic") and not _is_positive(self.resample):
            raise SettingsError(
                f"resample is {self.resample!r:.80}; expected isotropic, or a positive distance in mm"
            )

    @property
    def most_kept(self) -> int | None:
        """Return how many components are kept, None where that is left open."""
        if self.keep is None:
            return None
        if self.keep == "largest":
            return 1
        if not self.keep.isdecimal() or int(self.keep) < 1:
            raise SettingsError(f"keep is {self.keep!r:.80}; expected largest, or how many, 1 or more")
        return int(self.keep)

    @property
    def largest_cavity(self) -> float | None:
        """Return the volume in mm3 up to which cavities are filled, None where none is."""
        if self.fill_cavities is None:
            return None
        if self.fill_cavities == "all":
            return math.inf
        try:
            volume = float(self.fill_cavities)
        except ValueError:
            volume = math.nan
        if not 0 < volume < math.inf:
            raise SettingsError(
                f"fill_cavities is {self.fill_cavities!r:.80}; expected all, or a positive volume in mm3"
            )
        return volume

    @property
    def selects(self) -> bool:
        """Return whether components are looked for."""
        return self.changes_bits or (self.keep, self.min_volume, self.fill_cavities) != (None, None, None)

    @property
    def changes_bits(self) -> bool:
        """Return whether the object is opened or closed."""
        return (self.open_gaps, self.close_gaps) != (None, None)

    @property
    def filters(self) -> bool:
        """Return whether values are smoothed or taken at other distances."""
        return (self.resample, self.smooth_volume) != (None, None)

    @property
    def is_whole(self) -> bool:
        """Return whether the volume is contoured as it is."""
        return self == PartSettings()


@dataclass(frozen=True, kw_only=True)
class MeshSettings:
    """What becomes of the surface's quads; `project` puts vertices that have moved back on the surface.

    `remesh` is the number of rounds of remeshing, which implies the simplification by all patterns; `quads`
    how many to leave then, a number or a share as in "25%"; `relax` the number of steps of smoothing on the
    surface, at last. `repair_intersections` has faces that intersect pulled apart; without a
    word, where it is required that there are none.
    """

    simplify: Simplify = "none"
    simplify_rules: SimplifyRules = "safe"
    project: bool = True
    remesh: int = 0
    quads: str | int | None = None
    relax: int = 0
    repair_intersections: bool | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        if is_whole(self.quads):
            object.__setattr__(self, "quads", str(self.quads))
        settle_types(self)
        if self.quads is not None:
            wanted_quads(str(self.quads), 0)
            self._check_decimation()
        if self.remesh < 0:
            raise SettingsError(f"remesh is {self.remesh}; expected a number of rounds, 0 or more")
        if self.relax < 0:
            raise SettingsError(f"relax is {self.relax}; expected a number of steps, 0 or more")
        if self.remesh:
            self._settle_remeshing()

    def _check_decimation(self) -> None:
        """Raise SettingsError if what comes before does not leave a mesh on the surface."""
        if self.simplify != "none" and (self.simplify_rules == "paper" or not self.project):
            found = "simplify_rules is 'paper'" if self.simplify_rules == "paper" else "project is off"
            raise SettingsError(
                f"quads is {self.quads!r:.80}, but {found}; expected the safe rules and vertices on the"
                " surface, which collapses rely on"
            )

    def _settle_remeshing(self) -> None:
        """Raise SettingsError if remeshing cannot follow; set the simplification that it implies."""
        if self.simplify_rules == "paper" or not self.project:
            found = "simplify_rules is 'paper'" if self.simplify_rules == "paper" else "project is off"
            raise SettingsError(
                f"remesh is {self.remesh}, but {found}; expected the safe rules and vertices on the surface,"
                " which its operations rely on"
            )
        if self.simplify not in ("none", "all"):
            raise SettingsError(
                f"remesh is {self.remesh}, but simplify is {self.simplify!r}; expected 'all', which remeshing"
                " implies, or leave it out"
            )
        object.__setattr__(self, "simplify", "all")

    @property
    def follows_paper(self) -> bool:
        """Return whether the mesh is simplified by the papers' bare rules, which promise nothing."""
        return self.simplify != "none" and self.simplify_rules == "paper"

    @property
    def is_changed(self) -> bool:
        """Return whether vertices or quads do not stay as the surface has them."""
        return self.simplify != "none" or self.relax > 0 or self.quads is not None


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
    """Return whether faces that intersect are pulled apart: where that is asked for or, else, required."""
    if mesh.repair_intersections is not None:
        return mesh.repair_intersections
    return "no-self-intersections" in require or "print" in require


@dataclass(frozen=True, kw_only=True)
class OutputSettings:
    """What to write where, and what must hold before it is written.

    `path`, `halfedges` and `report` may be `-`, standard output, but only one of them. Without
    `output_format` the suffix of `path` chooses it. `unit` is that of the coordinates, and so of area
    and volume; grid indices have none. `values` lists what stands beside each vertex or face in the file;
    `element` is what a quad is to a solver (S4R without it), a triangle what goes with that.
    `curvature` has the report tell that, too. `require` lists what the mesh must be, words and comparisons
    of `requirements.py`; `check` verifies every invariant of the result; `dry_run` does everything but write
    the mesh; `memory` is the budget in bytes that the forecast is held against.
    """

    path: str
    output_format: str | None = None
    normals: bool = True
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
    require: tuple[str, ...] = ()
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
        check_outputs({"mesh": self.path, "halfedges": self.halfedges, "report": self.report}, STREAM)
        if self.curvature and self.report is None:
            raise SettingsError(
                "curvature was asked for, but no report that tells it; name one with --report"
            )

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
    def finds_curvature(self) -> bool:
        """Return whether the mesh's curvature is measured: for a report that tells it or a requirement."""
        return self.curvature or looks_at("curvature.", self.require, CONVERT_FIGURES)


@dataclass(frozen=True, kw_only=True)
class MemoryShare:
    """How the jobs of a batch share the memory: `free` is what was free, in bytes, before the first began.

    None where the system does not tell. A run alone is one job, which looks itself at what is free.
    """

    jobs: int = 1
    free: int | None = None


@dataclass(frozen=True, kw_only=True)
class ConvertSettings:
    """Everything that `dmc convert` needs to know; `input` is a path, `-` or `synth:FIELD:N`."""

    input: str
    surface: SurfaceSettings
    output: OutputSettings
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
        check_run(self.device, self.threads)
        self._check_method()

    def _check_method(self) -> None:
        """Raise SettingsError if the method's mesh cannot be what the other settings need."""
        method, mesh = method_named(self.surface.method), self.mesh
        if mesh.is_changed and method.faces != "quads":
            name = next(each for each in ("remesh", "quads", "relax", "simplify") if _is_asked(mesh, each))
            others = methods_that(lambda other: other.faces == "quads")
            raise self._not_of_method(name, getattr(mesh, name), f"makes {method.faces}", others)
        if mesh.follows_paper and method.color is None:
            others = methods_that(lambda other: other.color is not None)
            raise self._not_of_method("simplify_rules", mesh.simplify_rules, "colours no faces", others)

    def _not_of_method(self, name: str, given: object, found: str, others: list[str]) -> SettingsError:
        """Return the error that a setting needs what the method's mesh is not."""
        return SettingsError(
            f"{name} is {given!r:.80}, but the method {self.surface.method} {found}; leave {name} out, or"
            f" choose a method that suits it: {', '.join(others)}"
        )

    @property
    def repairs_intersections(self) -> bool:
        """Return whether faces that intersect are pulled apart."""
        return repairs(self.mesh, self.output.require)

    @property
    def needs_halfedges(self) -> bool:
        """Return whether halfedges are needed: to change or measure the mesh, for valences or the dump."""
        output = self.output
        is_wanted = output.halfedges is not None or output.is_measured or "valence" in output.values
        return self.mesh.is_changed or is_wanted or self.repairs_intersections

    @property
    def needs_colors(self) -> bool:
        """Return whether colours are needed: for the dump, if the method has any, or by the papers' rules."""
        has_colors = method_named(self.surface.method).color is not None
        return (self.output.halfedges is not None and has_colors) or self.mesh.follows_paper


def _is_asked(mesh: MeshSettings, name: str) -> bool:
    """Return whether a setting of the mesh is not what it is without the user's word."""
    return bool(getattr(mesh, name) != getattr(MeshSettings(), name))


@dataclass(frozen=True, kw_only=True)
class LabelSettings:
    """Which labels of a label map to make surfaces of, and where they go.

    `labels` are numbers or names, or `all`, which none means, too; `label_names` is a table of names and
    colours (ITK-SNAP, FreeSurfer, 3D Slicer, BIDS), where the input has none, or others. Without `conforming`
    each has a closed shell of its own: `output.path` is a template with `{label}` in it, or one file. With it
    all are one mesh, whose faces know the labels on both sides; it has no normals, since vertices where
    labels meet have several.
    """

    input: str
    output: OutputSettings
    labels: tuple[str, ...] = ()
    conforming: bool = False
    label_names: str | None = None
    read: ReadSettings = field(default_factory=ReadSettings)
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
        output = self.output
        if output.halfedges is not None or output.curvature or output.check or output.values:
            raise SettingsError(
                "halfedges, curvature, check and values are of a surface at an isovalue; leave them out"
                " with labels"
            )
        settled_requirements(output.require, MEASURE_FIGURES)
        if "on-surface" in output.require:
            raise SettingsError(
                "on-surface was required of labels, whose surfaces are at no isovalue; leave it out"
            )


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
        if self.marked is not None and not self.require:
            raise SettingsError(
                f"marked is {self.marked!r:.80}, but nothing is required that a face could be to blame for;"
                " say what with --require"
            )
        object.__setattr__(self, "require", settled_requirements(self.require, MEASURE_FIGURES))
        if self.density is not None and not 0 < self.density < math.inf:
            raise SettingsError(f"density is {self.density}; expected a positive number of samples")
        if self.wall is not None and not 0 < self.wall < math.inf:
            raise SettingsError(f"wall is {self.wall}; expected a positive length")
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


@dataclass(frozen=True, kw_only=True)
class ReworkSettings:
    """What to do to the mesh of a file, and where to write it.

    `keep` is how many components stay, those with most faces; `min_faces` the fewest faces of one that stays;
    `flip` turns all faces round. What `operations` do needs quads and the volume and isovalue that the mesh
    was made of, `inside` being the side that was the object. `unit` and `space` are those of the file unless
    others are named. Outputs are those of `OutputSettings`.
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
    normals: bool = True
    output_format: str | None = None
    ascii: bool = False
    values: tuple[MeshValue, ...] = ()
    element: Element | None = None
    force: bool = False
    report: str | None = None
    require: tuple[str, ...] = ()
    dry_run: bool = False
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("mesh", self.mesh)
        check_path("volume", self.volume)
        check_outputs({"mesh": self.path, "report": self.report}, STREAM)
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
        if self.operations.is_changed and self.volume is None:
            names = ("remesh", "quads", "simplify", "relax")
            name = next(each for each in names if _is_asked(self.operations, each))
            raise SettingsError(
                f"{name} is {getattr(self.operations, name)!r}, but no volume was given, on whose isosurface"
                " the vertices are kept; name it with --volume and -i"
            )
        if self.operations.repair_intersections and self.volume is None:
            raise SettingsError(
                "repair_intersections is True, but no volume was given, near whose isosurface the vertices"
                " are kept; name it with --volume and -i"
            )
        if self.operations.follows_paper:
            raise SettingsError(
                "simplify_rules is 'paper', by the colours of the grid, which files of meshes lack; expected"
                " 'safe'; leave it out"
            )

    @property
    def is_measured(self) -> bool:
        """Return whether the mesh's measures are needed: for a report or a requirement."""
        return self.report is not None or bool(self.require)


@dataclass(frozen=True, kw_only=True)
class CompareSettings:
    """Which methods to compare on the surface of a volume; `isovalue` as in `SurfaceSettings`.

    A method is its name, behind a colon a value of one of its options, and `+simplify` for its quads without
    the papers' patterns: `dc:particle`, `dmc+simplify`. Without any, all methods with their defaults are
    compared, and the simplified mesh of the first. `repeats` is how often each surface is extracted; the
    least time counts.
    """

    input: str
    isovalue: float | str | None = None
    methods: tuple[str, ...] = ()
    inside: Inside = "above"
    border: Border = "open"
    read: ReadSettings = field(default_factory=ReadSettings)
    repeats: int = 3
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("input", self.input)
        check_run(self.device, self.threads)
        check_isovalue(self.isovalue)
        if not self.methods:
            object.__setattr__(self, "methods", (*METHODS, f"{next(iter(METHODS))}{SIMPLIFIED}"))
        if len(set(self.methods)) < len(self.methods):
            raise SettingsError(f"methods are {', '.join(self.methods)}; expected each once")
        if self.repeats < 1:
            raise SettingsError(f"repeats is {self.repeats}; expected 1 or more")
        for method in self.methods:
            self.surface_of(method)

    def surface_of(self, method: str) -> SurfaceSettings:
        """Return the settings of a method's surface, `method` as in `methods`.

        Raises:
            SettingsError: There is no such method, or none of its options has that value.
        """
        name, _, value = method.removesuffix(SIMPLIFIED).partition(":")
        taken = method_named(name).options
        chosen: dict[str, Any] = {}
        if value:
            known = {each: option for option, values in taken.items() for each in values}
            if value not in known:
                raise SettingsError(
                    f"{value!r:.80} is no value of an option of the method {name}; expected one of"
                    f" {', '.join(sorted(known)) or 'none'}"
                )
            chosen[known[value]] = value
        if method.endswith(SIMPLIFIED) and method_named(name).faces != "quads":
            raise SettingsError(f"{method:.80} is none: simplification needs quads; leave {SIMPLIFIED} out")
        if "border" in taken:
            chosen["border"] = self.border
        return SurfaceSettings(isovalue=self.isovalue, method=name, inside=self.inside, **chosen)


@dataclass(frozen=True, kw_only=True)
class ReproduceSettings:
    """Which of the papers' tables to make again, from data sets of at most `up_to` nodes an axis.

    `scans` says where scans of Schmitz et al. 2009 are, `NAME=FILE` each: engine, bonsai, backpack, stent.
    """

    table: tuple[PaperTable, ...] = ()
    up_to: int = 512
    scans: tuple[str, ...] = ()
    placement: str = "sampled"
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        if self.up_to < 1:
            raise SettingsError(f"up_to is {self.up_to}; expected a number of nodes an axis")
        settled_option("dmc", "placement", self.placement)
        check_run(self.device, self.threads)
