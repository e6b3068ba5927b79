"""Judge a mesh by what `--require` asks of it: a verdict for each word, set and comparison.

A word looks at one or several figures of the report, a comparison at one, a set at those of its parts. What
has no value is not met. Of what is not met the faces are named that are to blame, where any are.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmc_cli.array_types import Int32Array
from dmc_cli.errors import RequirementError
from dmc_cli.measures import cause_and_remedy
from dmc_cli.mesh import COARSE, Mesh
from dmc_cli.methods import method_named, methods_that
from dmc_cli.report.blamed_faces import blamed_faces, kind_of
from dmc_cli.requirements import (
    CONVERT_FIGURES,
    MEASURE_FIGURES,
    MESH_FIGURES,
    SETS,
    WORDS,
    Comparison,
    parse_requirement,
)

ON_SURFACE = 1e-5
"""Largest deviation, as a share of the value range, of a vertex that is on the surface: a hundred times what
float32 local coordinates cost, and far below what a picture or a measurement could show."""

MOST_FACES = 100
"""Faces that a verdict names, at most."""

Section = Mapping[str, Any]

_REMEDIES = {
    "deviation": "name the volume that the mesh was made from",
    "distance": "--against",
    "simplification": "--simplify",
}
"""What has a section of the report measured that is not always there."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What became of one requirement.

    Attributes:
        require: The word, the set or the comparison, as it was given.
        found: The figure that it looks at; of a word, how much is in its way: 0 if nothing is; of a set, how
            many of its parts are not met. None if there is no value.
        failure: What is told if it is not met: what was found, what was expected, what may help; else None.
        parts: The verdicts on the parts of a set.
        face_count: Faces that it is due to that it is not met; None if it is, or if none can be blamed.
        faces: The first of them.
    """

    require: str
    found: float | None
    failure: str | None = None
    parts: "tuple[Verdict, ...]" = ()
    face_count: int | None = None
    faces: tuple[int, ...] = ()

    @property
    def section(self) -> dict[str, Any]:
        """Return it as the report has it."""
        section: dict[str, Any] = {"require": self.require, "found": self.found, "met": self.failure is None}
        if self.face_count is not None:
            section |= {"face_count": self.face_count, "faces": list(self.faces)}
        if self.parts:
            section["parts"] = [part.section for part in self.parts]
        return section


def judge(report: Section, required: Iterable[str]) -> list[Verdict]:
    """Return the verdict on each requirement, in their order; one that is named twice counts once.

    Args:
        report: A report with its measured sections.
        required: Words, sets and comparisons.

    Raises:
        SettingsError: One is none of these.
    """
    texts = list(dict.fromkeys(required))
    return [
        _verdict_on_set(report, text, texts) if text in SETS else _verdict(report, text) for text in texts
    ]


def check_requirements(
    report: dict[str, Any], required: Iterable[str], mesh: Callable[[], Mesh] | None = None
) -> None:
    """Put the verdicts into the report, and raise unless the mesh is everything that is asked.

    Args:
        report: A report with its measured sections.
        required: Words, sets and comparisons.
        mesh: Returns the mesh, whose faces are looked at if something is not met; without it none are named.

    Raises:
        RequirementError: Names every requirement that is not met, what was found, and what may help; it has
            the report.
    """
    verdicts = judge(report, required)
    if mesh is not None and any(verdict.failure is not None for verdict in verdicts):
        verdicts = _with_faces(verdicts, mesh(), _figures(report))
    report["requirements"] = [verdict.section for verdict in verdicts]
    failures = [verdict.failure for verdict in verdicts if verdict.failure is not None]
    if failures:
        told = "the mesh is not what --require asks for: " + "; ".join(failures)
        raise RequirementError(told, report)


def count_blame(report: Section, required: Iterable[str], mesh: Mesh) -> Int32Array:
    """Return for each face how many requirements it is to blame for that are not met, (F,) int32.

    Args:
        report: The report on the mesh.
        required: Words, sets, whose parts count each, and comparisons.
        mesh: The mesh.
    """
    counts = np.zeros(mesh.face_count, np.int32)
    for verdict in judge(report, required):
        for part in verdict.parts or (verdict,):
            if part.failure is not None:
                mask = blamed_faces(mesh, parse_requirement(part.require, _figures(report)))
                counts += 0 if mask is None else mask
    return counts


def _verdict(report: Section, text: str) -> Verdict:
    asked = parse_requirement(text, _figures(report))
    if isinstance(asked, Comparison):
        found = _figure(report, asked.figure)
        return Verdict(require=text, found=found, failure=_compared(report, text, asked, found))
    figures = [_figure(report, name) for name in WORDS[asked]]
    found = None if None in figures else sum(figures)
    return Verdict(require=text, found=found, failure=CHECKS[asked](report))


def _verdict_on_set(report: Section, name: str, required: Sequence[str]) -> Verdict:
    """Return the verdict on a set of words and comparisons, which all have to be met."""
    parts = tuple(_verdict(report, text) for text in _parts(report, name, required))
    failures = [f"{name}: {part.failure}" for part in parts if part.failure is not None]
    return Verdict(require=name, found=len(failures), failure="; ".join(failures) or None, parts=parts)


def _parts(report: Section, name: str, required: Sequence[str]) -> list[str]:
    """Return the parts of a set that count for this mesh, beside whatever else is required."""
    asked = [parse_requirement(text, _figures(report)) for text in required if text not in SETS]
    told = {one.figure for one in asked if isinstance(one, Comparison)}
    kinds = {"quads": report["mesh"]["quads"], "triangles": report["mesh"]["triangles"]}
    found = []
    for part in SETS[name]:
        one = parse_requirement(part, _figures(report))
        figure = one.figure if isinstance(one, Comparison) else ""
        kind = kind_of(figure)
        if (kind is None or kinds[kind]) and not (figure == "topology.components" and figure in told):
            found.append(part)
    wall = (report.get("thickness") or {}).get("limit")
    return [*found, f"thickness.min>={wall:.12g}"] if name == "print" and wall is not None else found


def _with_faces(verdicts: Sequence[Verdict], mesh: Mesh, figures: tuple[str, ...]) -> list[Verdict]:
    """Return verdicts that name the faces which those that are not met are due to."""
    found = []
    for verdict in verdicts:
        masks = []
        for part in verdict.parts or (verdict,):
            if part.failure is not None:
                masks.append(blamed_faces(mesh, parse_requirement(part.require, figures)))
        blamed = [mask for mask in masks if mask is not None]
        if not blamed:
            found.append(verdict)
            continue
        numbers = np.flatnonzero(np.logical_or.reduce(blamed))
        first = tuple(numbers[:MOST_FACES].tolist())
        found.append(replace(verdict, face_count=len(numbers), faces=first))
    return found


def is_of_file(report: Section) -> bool:
    """Return whether a report is on the mesh of a file, which no option makes by another method."""
    return "surface" not in report


def _figures(report: Section) -> tuple[str, ...]:
    """Return the whole names of the figures that the report has by the command that it is of."""
    if not is_of_file(report):
        return CONVERT_FIGURES
    return MESH_FIGURES if "settings" in report else MEASURE_FIGURES


def _figure(report: Section, name: str) -> Any:
    """Return a figure by its whole name; None where it, or its section, has no value."""
    found: Any = report
    for key in name.split("."):
        found = None if found is None else found.get(key)
    return found


def _compared(report: Section, text: str, asked: Comparison, found: float | None) -> str | None:
    """Say that a figure is not as required; None if it is."""
    if asked.holds(found):
        return None
    if found is not None:
        return f"{text}: {_shown(found)} was found; expected {asked.expected}"
    section = asked.figure.partition(".")[0]
    remedy = f" ({_REMEDIES[section]})" if section in _REMEDIES and not report.get(section) else ""
    return f"{text}: the figure has no value; expected {asked.expected}{remedy}"


def _shown(found: float) -> str:
    """Return a figure as a message has it: a count whole, another number shortly."""
    return str(found) if isinstance(found, int) else f"{found:.6g}"


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


def _advice(report: Section, text: str) -> str:
    """Return what may help in brackets, but of the mesh of a file nothing: no option makes that anew."""
    return "" if is_of_file(report) else f" ({text})"


def _manifold_advice(report: Section) -> str:
    """Name the topology whose meshes are manifold, or where the method has none, the methods that have."""
    if is_of_file(report) or method_named(report["settings"]["method"]).manifold:
        return _advice(report, "--topology manifold")
    return f" (--method {' or '.join(methods_that(lambda method: bool(method.manifold)))})"


def _closed(report: Section) -> str | None:
    edges, loops = report["topology"]["boundary_edges"], report["topology"]["boundary_loops"]
    if not edges:
        return None
    advice = _advice(report, "--border closed")
    return f"closed: {edges} boundary edges in {loops} loop(s) were found; expected none{advice}"


def _all_quads(report: Section) -> str | None:
    triangles = report["mesh"].get("triangles", 0)
    if not triangles:
        return None
    methods = " or ".join(methods_that(lambda method: method.faces == "quads"))
    advice = _advice(report, f"--method {methods}")
    return f"all-quads: {triangles} triangles were found; expected none{advice}"


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
    if is_of_file(report):
        return ""
    chosen = report["settings"]
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
