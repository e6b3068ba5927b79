"""Change the mesh on its way from the surface, or a file, to the output: simplify, remesh, decimate, relax.

Stages that not every run needs are imported where they are called.
"""

from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.mesh import Mesh, Placement
from dmc_cli.notices import Notice
from dmc_cli.progress import Stopwatch
from dmc_cli.settings import MeshSettings

if TYPE_CHECKING:  # its kernels are only imported by runs that take quads away
    from dmc_cli.app.fine_mesh import FineMesh
    from dmc_cli.volume import Volume


@dataclass
class Stages:
    """The mesh on its way through the stages, and what they report; without a field it has no placement.

    Nothing else holds the mesh, so that a stage that replaces its arrays has their memory back.
    """

    mesh: Mesh
    placement: Placement | None
    vertex_color: Any = None
    simplification: dict[str, Any] = field(default_factory=dict)
    repair: dict[str, int] = field(default_factory=dict)
    size: dict[str, Any] = field(default_factory=dict)
    fine: "FineMesh | None" = None
    to_mm: Any = None
    warnings: tuple[Notice, ...] = ()

    def require_placement(self) -> Placement:
        """Return where the vertices lie on the surface of a field."""
        assert self.placement is not None
        return self.placement

    def to_millimetres(self, volume: "Volume") -> Float64Array:
        """Return the map from differences of coordinates to the volume's millimetres, shape (3, 3).

        Raises:
            SettingsError: There is none.
        """
        from dmc_cli.app.fine_mesh import to_millimetres

        frame = self.require_placement().frame
        return to_millimetres(frame.affine, volume, has_depths=frame.depths.shape[0] > 0)


def simplify_stages(stages: Stages, settings: MeshSettings, watch: Stopwatch) -> None:
    """Remove the papers' patterns, and remesh if that is asked for."""
    from dmc_cli.mesh import irregular_percent
    from dmc_cli.processing import simplify

    irregular_before = irregular_percent(stages.mesh)
    with watch.stage("simplify", "simplifying"):
        result = simplify(stages.mesh, stages.require_placement(), settings)
        stages.mesh, stages.placement = result.mesh, result.placement
    stages.simplification = {
        "removed_3x3y": sum(result.removed_3x3y),
        "removed_3333": result.removed_3333,
        "refused": result.refused,
        "irregular_percent_before": irregular_before,
        "irregular_percent_after": irregular_percent(stages.mesh),
    }
    del result
    if settings.remesh:
        _remesh(stages, settings.remesh, watch)


def _remesh(stages: Stages, rounds: int, watch: Stopwatch) -> None:
    """Remove irregular vertices that the papers' patterns leave."""
    from dmc_cli.mesh import irregular_percent
    from dmc_cli.processing import Rounds

    with watch.stage("remesh", "remeshing"):
        sweeps = Rounds(stages.mesh, stages.require_placement())
        del stages.mesh, stages.placement  # the rounds let go of what they replace
        result = sweeps.run(rounds, watch.progress)
        stages.mesh, stages.placement = result.mesh, result.placement
    found = stages.simplification
    found["irregular_percent_patterns"] = found["irregular_percent_after"]
    found["irregular_percent_after"] = irregular_percent(stages.mesh)
    stages.simplification = found | {"rounds": rounds, "operations": result.operations}


def decimate_stages(
    stages: Stages, settings: MeshSettings, to_mm: Any, watch: Stopwatch, *, is_measured: bool
) -> None:
    """Take quads away as far as is asked for, and tell where that cannot be.

    Args:
        stages: The mesh.
        settings: What is asked for.
        to_mm: Maps differences of coordinates to millimetres, shape (3, 3).
        watch: Times the stage.
        is_measured: Whether the report tells the distances from the mesh before.
    """
    from dmc_cli.app.fine_mesh import FineMesh, in_millimetres
    from dmc_cli.app.size import quads_to_leave, size_section, size_warnings
    from dmc_cli.processing import Bound, Decimation

    before = stages.mesh.face_count
    with watch.stage("size", "taking quads away"):
        wanted = quads_to_leave(settings, in_millimetres(stages.mesh, to_mm))
        bound = None
        if is_measured or settings.max_error is not None:
            stages.fine = FineMesh(stages.mesh, to_mm, settings.max_error)
        if stages.fine is not None and settings.max_error is not None:
            bound = Bound(settings.max_error / float(np.linalg.norm(to_mm, 2)), stages.fine.find_beyond)
        rounds = Decimation(stages.mesh, stages.placement, bound)
        del stages.mesh, stages.placement  # the rounds let go of what they replace
        result = rounds.run(wanted or 1, watch.progress)
        stages.mesh, stages.placement, stages.to_mm = result.mesh, result.placement, to_mm
    stages.size = size_section(result, wanted, before, settings)
    stages.warnings = size_warnings(stages.size)


def size_kernels(settings: MeshSettings, *, is_measured: bool) -> list[ModuleType]:
    """Return the modules whose kernels measure what becomes of a size that is asked for."""
    from dmc_cli.measures import distance_kernels, kernel_modules

    if is_measured or settings.max_error is not None:
        return distance_kernels(proves=settings.max_error is not None)
    return [] if settings.edge_length is None else kernel_modules(intersections=False)


def relax_stages(stages: Stages, steps: int, watch: Stopwatch) -> None:
    """Smooth on the surface."""
    from dmc_cli.processing import relax

    before = _kept_of(stages)
    with watch.stage("relax", "relaxing"):
        stages.mesh, stages.placement = relax(stages.mesh, stages.require_placement(), steps, watch.progress)
        _hold_bound(stages, before)


def repair_stages(stages: Stages, watch: Stopwatch) -> None:
    """Pull faces apart that intersect."""
    from dmc_cli.measures import find_intersections
    from dmc_cli.processing import repair_intersections

    before = _kept_of(stages)
    stages.mesh.device.let_go()  # what the stages before left would stand beside copies of other sizes
    with watch.stage("repair", "undoing intersections"):
        result = repair_intersections(stages.mesh, stages.placement, find_intersections)
        stages.mesh, stages.placement = result.mesh, result.placement
        pairs = result.pairs_after
        if result.moved and _hold_bound(stages, before):
            pairs = len(find_intersections(stages.mesh))
    stages.repair = {
        "pairs_before": result.pairs_before,
        "pairs_after": pairs,
        "moved": result.moved,
        "left_surface": result.left_surface,
        "rounds": result.rounds,
    }


def _kept_of(stages: Stages) -> tuple[Mesh, Placement | None] | None:
    """Return the mesh to which vertices go back where they break a bound on the distance."""
    is_bounded = stages.fine is not None and stages.fine.max_error is not None
    return (stages.mesh, stages.placement) if is_bounded else None


def _hold_bound(stages: Stages, before: tuple[Mesh, Placement | None] | None) -> int:
    """Take vertices back that have broken the bound on the distance, if there is one; return how many."""
    if stages.fine is None or before is None:
        return 0
    stages.mesh, stages.placement, back = stages.fine.take_back(stages.mesh, stages.placement, before)
    stages.size["taken_back"] += back
    return back


def measure_size(stages: Stages, watch: Stopwatch) -> None:
    """Complete what is told of the size by what the mesh is that is written."""
    if not stages.size:
        return
    from dmc_cli.app.size import distance_sections, mean_edge_length

    with watch.stage("size", "measuring distances"):
        stages.size["edge_length"] = mean_edge_length(stages.mesh, stages.to_mm)
        if stages.fine is not None:
            stages.size.update(distance_sections(stages.fine.distance_of(stages.mesh)))
            stages.fine = None
