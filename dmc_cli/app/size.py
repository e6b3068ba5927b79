"""Tell what became of the size that was asked for: what was reached, and what stopped it."""

from typing import TYPE_CHECKING, Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.measures import MeshDistance, measure_quality
from dmc_cli.mesh import Mesh
from dmc_cli.notices import Notice
from dmc_cli.settings import MeshSettings, wanted_quads

if TYPE_CHECKING:  # its kernels are only imported by runs that take quads away
    from dmc_cli.processing import Decimated

STOPPED = {
    "topology": "they would tear the mesh, or close a hole of it",
    "shape": "they would leave a quad that is folded or too thin",
    "distance": "they would go too far from the surface",
    "fixed": "the quads stand at a boundary, whose vertices stay",
    "max_error": "they would go further from the mesh before than was asked for",
}
"""What each reason of a refusal means."""


def quads_to_leave(settings: MeshSettings, mesh: Mesh) -> int | None:
    """Return how many quads to leave of a mesh in millimetres, None where that is left to the bound."""
    if settings.quads is not None:
        return wanted_quads(str(settings.quads), mesh.face_count)
    if settings.edge_length is not None:
        return max(1, round(measure_quality(mesh).area / settings.edge_length**2))
    return None


def mean_edge_length(mesh: Mesh, to_mm: Float64Array) -> float | None:
    """Return the mean length of the sides of a mesh's quads in millimetres, None of none."""
    if not mesh.face_count:
        return None
    corners = mesh.positions.numpy()[mesh.faces.numpy()].astype(np.float64)
    sides = (np.roll(corners, -1, axis=1) - corners) @ to_mm.T
    return float(np.linalg.norm(sides, axis=2).mean())


def size_section(
    result: "Decimated", wanted: int | None, before: int, settings: MeshSettings
) -> dict[str, Any]:
    """Return the report's section `size`, but for what is known when the mesh is as it is written.

    Args:
        result: What became of the mesh.
        wanted: Quads that were to be left, None where that was left to the bound.
        before: Quads that there were.
        settings: What was asked for.
    """
    quads = result.mesh.face_count
    left = quads > (wanted or 0)
    reasons = {**result.refusals, "fixed": result.fixed} if left else {}
    most = max(reasons, key=lambda name: reasons[name], default=None)
    return {
        "quads_wanted": wanted,
        "edge_length_wanted": settings.edge_length,
        "max_error": settings.max_error,
        "quads_before": before,
        "quads": quads,
        "edge_length": None,
        "reached": None if wanted is None else not left,
        "stopped_by": "max_error" if most == "distance" and settings.max_error is not None else most,
        "refusals": result.refusals,
        "fixed_quads": result.fixed,
        "rounds": result.rounds,
        "taken_back": 0,
        "to_before": None,
        "from_before": None,
    }


def distance_sections(distance: MeshDistance) -> dict[str, Any]:
    """Return what is told of the distances to the mesh before quads were taken away, and from it."""
    ways = {"to_before": distance.to_other, "from_before": distance.from_other}
    return {
        name: {"samples": way.samples, "mean": way.mean, "rms": way.rms, "max": way.max}
        for name, way in ways.items()
    }


def size_warnings(size: dict[str, Any]) -> tuple[Notice, ...]:
    """Return the warnings that the number was not met, or had nothing to do."""
    wanted, quads = size["quads_wanted"], size["quads"]
    if wanted is None:
        return ()
    if not size["reached"]:
        return (
            Notice(
                "W-QUADS-LEFT",
                f"{quads} quads are left of the {wanted} that were asked for: no further collapse was found,"
                f" mostly because {STOPPED[size['stopped_by']]}",
            ),
        )
    if size["quads_before"] <= wanted:
        return (
            Notice(
                "W-QUADS-FEWER",
                f"the mesh has {quads} quads, no more than the {wanted} that were asked for; none were taken"
                " away",
            ),
        )
    return ()
