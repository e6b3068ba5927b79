"""Check what `--require` asks of a mesh."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from dmc_cli.errors import RequirementError
from dmc_cli.measures import cause_and_remedy
from dmc_cli.mesh import COARSE
from dmc_cli.methods import method_named, methods_that
from dmc_cli.settings import Requirement

ON_SURFACE = 1e-5
"""Largest deviation, as a share of the value range, of a vertex that is on the surface: a hundred times what
float32 local coordinates cost, and far below what a picture or a measurement could show."""

Section = Mapping[str, Any]


def check_requirements(report: Section, names: Iterable[Requirement]) -> None:
    """Raise unless the mesh is everything that is asked.

    Args:
        report: A report with its measured sections: mesh, topology and deviation.
        names: Requirements; one that is named twice counts once.

    Raises:
        RequirementError: Names every requirement that is not met, what was found, and what may help.
    """
    failures = [failure for name in dict.fromkeys(names) if (failure := CHECKS[name](report))]
    if failures:
        raise RequirementError("the mesh is not what --require asks for: " + "; ".join(failures))


def _manifold(report: Section) -> str | None:
    topology = report["topology"]
    counts = {
        "vertices whose faces form several fans": topology["non_manifold_vertices"],
        "edges with more than two faces": topology["non_manifold_edges"],
        "edges that both faces run the same way": topology["misoriented_edges"],
    }
    found = [f"{count} {what}" for what, count in counts.items() if count]
    if not found:
        return None
    return f"manifold: {', '.join(found)} were found; expected none{_manifold_advice(report)}"


def _manifold_advice(report: Section) -> str:
    """Name the topology whose meshes are manifold, or where the method has none, the methods that have."""
    chosen = report.get("settings")
    if chosen is None or method_named(chosen["method"]).manifold:
        return " (--topology manifold)"
    return f" (--method {' or '.join(methods_that(lambda method: bool(method.manifold)))})"


def _closed(report: Section) -> str | None:
    edges, loops = report["topology"]["boundary_edges"], report["topology"]["boundary_loops"]
    if not edges:
        return None
    return f"closed: {edges} boundary edges in {loops} loop(s) were found; expected none (--border closed)"


def _all_quads(report: Section) -> str | None:
    triangles = report["mesh"].get("triangles", 0)
    if not triangles:
        return None
    methods = " or ".join(methods_that(lambda method: method.faces == "quads"))
    return f"all-quads: {triangles} triangles were found; expected none (--method {methods})"


def _on_surface(report: Section) -> str | None:
    if report["deviation"] is None:
        return "on-surface: the deviation is not known; name the volume that the mesh was made from"
    rounding = report["deviation"].get("rounding_relative")
    if rounding is not None and rounding > COARSE:
        cause, remedy = cause_and_remedy(report["deviation"]["rounding_mm"])
        return (
            f"on-surface: {cause} float32 coordinates are off by {rounding:.3g} of the spacing;"
            f" expected at most {COARSE:g} (--space voxel, or {remedy})"
        )
    if report["deviation"].get("max", 0.0) is None and report["mesh"]["vertices"]:
        return "on-surface: no vertex could be measured; expected cells whose corners have data"
    found = report["deviation"]["max_relative"]
    if found is None or found <= ON_SURFACE:
        return None
    return (
        f"on-surface: the largest deviation is {found:.3g} of the value range;"
        f" expected at most {ON_SURFACE:g}{_placement_advice(report)}"
    )


def _placement_advice(report: Section) -> str:
    """Name the placement that is on the surface, where the method has one and another was chosen.

    Where the method has none, name the methods that have.
    """
    chosen = report.get("settings")
    if chosen is None:  # of a mesh file
        return ""
    method = method_named(chosen["method"])
    if not method.on_surface:
        return f" (--method {' or '.join(methods_that(lambda other: bool(other.on_surface)))})"
    others = method.on_surface - {None, chosen["placement"]}
    return f" (--placement {' or '.join(sorted(filter(None, others)))})" if others else ""


def _no_self_intersections(report: Section) -> str | None:
    found = report["quality"]["self_intersections"]
    if found is None:
        return "no-self-intersections: the intersections were not counted; measure the mesh with them"
    if not found:
        return None
    return f"no-self-intersections: {found} pairs of faces that intersect were found; expected none"


CHECKS: dict[str, Callable[[Section], str | None]] = {
    "manifold": _manifold,
    "closed": _closed,
    "all-quads": _all_quads,
    "on-surface": _on_surface,
    "no-self-intersections": _no_self_intersections,
}
