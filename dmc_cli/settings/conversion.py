"""Say everything that a conversion needs to know."""

from dataclasses import dataclass, field

from dmc_cli.errors import SettingsError
from dmc_cli.methods import method_named, methods_that
from dmc_cli.settings.checks import check_path, check_run
from dmc_cli.settings.mesh import MeshSettings, repairs
from dmc_cli.settings.output import OutputSettings
from dmc_cli.settings.part import PartSettings
from dmc_cli.settings.reading import ReadSettings
from dmc_cli.settings.surface import SurfaceSettings
from dmc_cli.settings.types import settle_types


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
        name = mesh.first_change
        if name is not None and method.faces != "quads":
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
