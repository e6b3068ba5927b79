"""Say how an item of a batch ended, by what its report has."""

from dataclasses import asdict, dataclass, field
from typing import Any

from dmc_cli.app.conversion import ConvertResult
from dmc_cli.measures import measure_quality
from dmc_cli.mesh import mesh_of_file
from dmc_cli.mesh_io import MeshFile
from dmc_cli.runtime import select_device
from dmc_cli.settings import ConvertSettings, LabelSettings

QUALITY = (
    *("shape_mean", "shape_min", "scaled_jacobian_min", "min_angle", "max_angle", "warpage_max"),
    "self_intersections",
)
"""Figures of a report's section `quality` that an outcome has."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How one item ended.

    Attributes:
        input: Of the item.
        isovalue: A number once it is chosen; of a band and of an item that failed what was asked for. None of
            labels.
        label: Of a shell of a label map, each of which has an outcome, its label's number.
        output: Of the item.
        status: The exit status that `dmc convert` would have had.
        error: What went wrong, or None.
        seconds: How long it took; labels have equal parts of what all took.
        vertices: Of the mesh, also of one that is not as required; None where there is none.
        quads: Likewise.
        triangles: Likewise.
        quality: The figures of `QUALITY`; intersections only where a report or a requirement counts them.
        requirements: The verdicts on what was required.
        report: The report's file, or None if none was written.
        warnings: What is told beside a mesh that was made.
        warning_codes: Their codes.
    """

    input: str
    isovalue: float | str | None
    output: str
    label: int | None = None
    status: int
    error: str | None = None
    seconds: float = field(default=0.0, compare=False)
    vertices: int | None = None
    quads: int | None = None
    triangles: int | None = None
    quality: dict[str, float | None] | None = None
    requirements: tuple[dict[str, Any], ...] = ()
    report: str | None = None
    warnings: tuple[str, ...] = ()
    warning_codes: tuple[str, ...] = ()


def found_of(item: ConvertSettings, report: dict[str, Any], quality: dict[str, Any]) -> dict[str, Any]:
    """Return what an outcome has of the report on a mesh and of its quality."""
    return {
        "isovalue": report["settings"]["isovalue"],
        **{key: report["mesh"][key] for key in ("vertices", "quads", "triangles")},
        "quality": {key: quality[key] for key in QUALITY},
        "requirements": tuple(report["requirements"]),
        "report": item.output.report,
        "warnings": tuple(report["warnings"]),
        "warning_codes": tuple(report["warning_codes"]),
    }


def found_of_labels(
    item: LabelSettings, report: dict[str, Any], meshes: dict[str, MeshFile]
) -> list[dict[str, Any]]:
    """Return what the outcome of each label has of the report; of a shared mesh and of no label there is one.

    A shell has its quality where it was measured, or where it has a file of its own.
    """
    told = {"report": item.output.report} | {key: tuple(report[key]) for key in ("warnings", "warning_codes")}
    counts = ("vertices", "quads", "triangles")
    if item.conforming or not report["labels"]:
        return [told | {key: report["mesh"][key] for key in counts}]
    found = []
    for row in report["labels"]:
        quality = row["quality"]
        if quality is None and len(meshes) == len(report["labels"]):
            quality = _quick_quality(meshes[row["path"]], report["settings"])
        one = {
            "label": row["label"],
            "output": row["path"],
            "requirements": tuple(row.get("requirements", ())),
        }
        one["quality"] = None if quality is None else {key: quality[key] for key in QUALITY}
        found.append(told | one | {key: row["mesh"][key] for key in counts})
    return found


def quality_of(result: ConvertResult) -> dict[str, Any]:
    """Return the quality of a mesh; where no report has it, the figures that take hardly any time."""
    measured: dict[str, Any] | None = result.report["quality"]
    if measured is not None:
        return measured
    return _quick_quality(result.mesh, result.report["settings"])


def _quick_quality(file: MeshFile, settings: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of a mesh's quality that take hardly any time."""
    mesh = mesh_of_file(file, select_device(settings["device"], settings["threads"]))
    return asdict(measure_quality(mesh)) | {"self_intersections": None}
