"""Change the mesh on its way from the surface, or a file, to the output: simplify, remesh, decimate, relax.

Stages that not every run needs are imported where they are called.
"""

from dataclasses import dataclass, field
from typing import Any

from dmc_cli.mesh import Mesh, Placement
from dmc_cli.notices import Notice
from dmc_cli.progress import Stopwatch
from dmc_cli.settings import MeshSettings, wanted_quads


@dataclass
class Stages:
    """The mesh on its way through the stages, and what they report.

    Nothing else holds the mesh, so that a stage that replaces its arrays has their memory back.
    """

    mesh: Mesh
    placement: Placement
    vertex_color: Any = None
    simplification: dict[str, Any] = field(default_factory=dict)
    repair: dict[str, int] = field(default_factory=dict)
    size: dict[str, Any] = field(default_factory=dict)
    warnings: tuple[Notice, ...] = ()


def simplify_stages(stages: Stages, settings: MeshSettings, watch: Stopwatch) -> None:
    """Remove the papers' patterns, and remesh if that is asked for."""
    from dmc_cli.mesh import irregular_percent
    from dmc_cli.processing import simplify

    irregular_before = irregular_percent(stages.mesh)
    with watch.stage("simplify", "simplifying"):
        result = simplify(stages.mesh, stages.placement, settings)
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
        sweeps = Rounds(stages.mesh, stages.placement)
        del stages.mesh, stages.placement  # the rounds let go of what they replace
        result = sweeps.run(rounds, watch.progress)
        stages.mesh, stages.placement = result.mesh, result.placement
    found = stages.simplification
    found["irregular_percent_patterns"] = found["irregular_percent_after"]
    found["irregular_percent_after"] = irregular_percent(stages.mesh)
    stages.simplification = found | {"rounds": rounds, "operations": result.operations}


def decimate_stages(stages: Stages, wanted: str, watch: Stopwatch) -> None:
    """Take quads away until a wanted number is left, and tell where that cannot be."""
    from dmc_cli.app.size import size_section, size_warnings
    from dmc_cli.processing import Decimation

    before = stages.mesh.face_count
    with watch.stage("size", "taking quads away"):
        rounds = Decimation(stages.mesh, stages.placement)
        del stages.mesh, stages.placement  # the rounds let go of what they replace
        result = rounds.run(wanted_quads(wanted, before), watch.progress)
        stages.mesh, stages.placement = result.mesh, result.placement
    stages.size = size_section(result, before)
    stages.warnings = size_warnings(stages.size)


def relax_stages(stages: Stages, steps: int, watch: Stopwatch) -> None:
    """Smooth on the surface."""
    from dmc_cli.processing import relax

    with watch.stage("relax", "relaxing"):
        stages.mesh, stages.placement = relax(stages.mesh, stages.placement, steps, watch.progress)


def repair_stages(stages: Stages, watch: Stopwatch) -> None:
    """Pull faces apart that intersect."""
    from dmc_cli.measures import find_intersections
    from dmc_cli.processing import repair_intersections

    with watch.stage("repair", "undoing intersections"):
        result = repair_intersections(stages.mesh, stages.placement, find_intersections)
        stages.mesh, stages.placement = result.mesh, result.placement
    stages.repair = {
        "pairs_before": result.pairs_before,
        "pairs_after": result.pairs_after,
        "moved": result.moved,
        "left_surface": result.left_surface,
        "rounds": result.rounds,
    }
