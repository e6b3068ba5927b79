"""Report what surfaces of labels were made: a row a label, with its volume, and its measures if asked for."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dmc_cli.app.label_files import label_name
from dmc_cli.app.label_surfaces import LabelMesh
from dmc_cli.array_types import Float64Array
from dmc_cli.errors import RequirementError
from dmc_cli.measures import (
    count_intersections,
    list_components,
    measure_elements,
    measure_quality,
    measure_topology,
    plain,
)
from dmc_cli.mesh import connect, mesh_of_file
from dmc_cli.mesh_io import MeshFile
from dmc_cli.notices import Notice, warning_keys
from dmc_cli.progress import Stopwatch
from dmc_cli.report import (
    SCHEMA,
    check_requirements,
    collect_versions,
    components_section,
    extent_section,
    input_section,
    quality_section,
    topology_section,
)
from dmc_cli.runtime import Device
from dmc_cli.settings import SIZES, LabelSettings, OutputSpace
from dmc_cli.volume import Label, Volume


@dataclass(frozen=True)
class LabelSurface:
    """A label with its shell.

    Attributes:
        label: The label.
        nodes: How many nodes have it.
        file: Its shell.
        node_volume: The volume of the boxes round its nodes, None where slices are uneven.
        volume: The volume that the shell encloses.
        part: What was done to have a part of the label; None where the whole was wanted.
        size: What became of the size that was asked for.
        repair: How many pairs of its faces intersected then, and do.
        notices: What is told of that.
    """

    label: Label
    nodes: int
    file: MeshFile
    node_volume: float | None
    volume: float
    part: dict[str, Any] | None = None
    size: dict[str, Any] | None = None
    repair: dict[str, int] | None = None
    notices: tuple[Notice, ...] = ()


def node_size(volume: Volume, affine: Float64Array, space: OutputSpace) -> float | None:
    """Return the volume of the box round a node in the output's unit; None where slices are uneven."""
    if volume.slice_positions is not None and space != "voxel":
        return None
    return abs(float(np.linalg.det(affine[:3, :3])))


def label_report(
    settings: LabelSettings,
    volume: Volume,
    surfaces: Sequence[LabelSurface],
    meshes: Sequence[LabelMesh],
    paths: Sequence[str],
    told: Sequence[Notice],
    device: Device,
    watch: Stopwatch,
) -> dict[str, Any]:
    """Return the report, without timings and memory.

    Args:
        settings: What was asked for.
        volume: The label map.
        surfaces: The labels, in the order of their numbers.
        meshes: The mesh that they share, or one a layer.
        paths: The file of each label, or that of all.
        told: What is told beside the volume's own warnings.
        device: Where the mesh is measured, if it is.
        watch: Who times that.
    """
    is_measured = settings.output.is_measured
    shown = [*paths] if len(paths) == len(surfaces) else [*paths] * len(surfaces)
    with watch.stage("report", "measuring"):
        rows = [
            _label_row(surface, path, _measured(surface.file, settings, device) if is_measured else {})
            for surface, path in zip(surfaces, shown, strict=True)
        ]
    output, quads = settings.output, sum(len(mesh.faces) for mesh in meshes)
    report = {
        "schema": SCHEMA,
        **warning_keys([*volume.warnings, *told]),
        "input": input_section(volume, with_hash=is_measured),
        "settings": _settings_section(settings, device),
        "surface": {
            "method": "label_surfaces",
            "crossed_edges": quads,
            "labels": len(surfaces),
        },
        "mesh": _counts(surfaces, meshes)
        | {"triangles": 0, "unit": "voxel" if output.space == "voxel" else output.unit},
        "labels": rows,
        "timings_ms": {},
        "memory": {},
        "versions": collect_versions(device.name),
    }
    return {key: plain(section) for key, section in report.items()}


def _counts(surfaces: Sequence[LabelSurface], meshes: Sequence[LabelMesh]) -> dict[str, int]:
    """Return what there is of the mesh that labels share, or of all shells, where these have sizes."""
    if any(surface.size for surface in surfaces):
        return {
            "vertices": sum(len(surface.file.points) for surface in surfaces),
            "quads": sum(len(surface.file.faces) for surface in surfaces),
            "self_intersections": sum(
                surface.repair["pairs_after"] for surface in surfaces if surface.repair
            ),
        }
    return {
        "vertices": sum(len(mesh.points) for mesh in meshes),
        "quads": sum(len(mesh.faces) for mesh in meshes),
        "self_intersections": sum(mesh.intersections for mesh in meshes),
    }


def require_of_labels(report: dict[str, Any], required: Sequence[str]) -> None:
    """Put the verdicts into each label's row, and raise unless every shell is everything that is asked.

    Raises:
        RequirementError: Names each label whose shell is not; it has the report.
    """
    failures = []
    for row in report["labels"] if required else ():
        try:
            check_requirements(row, required)
        except RequirementError as error:
            failures.append(f"label {row['label']}: {error}")
    if failures:
        raise RequirementError("; ".join(failures), report)


def _label_row(surface: LabelSurface, path: str, measured: dict[str, Any]) -> dict[str, Any]:
    """Return what the report says of a label."""
    label, expected = surface.label, surface.node_volume
    return {
        "label": label.number,
        "name": label.name or label_name(label),
        "layer": label.layer,
        "color": label.color,
        "nodes": surface.nodes,
        "node_volume": expected,
        "part": surface.part,
        "path": path,
        "mesh": {
            "vertices": len(surface.file.points),
            "quads": len(surface.file.faces),
            "triangles": 0,
            "volume": surface.volume,
            "volume_change_percent": None if not expected else 100.0 * (surface.volume / expected - 1.0),
            **measured.get("extent", {}),
        },
        "topology": measured.get("topology"),
        "quality": measured.get("quality"),
        "components": measured.get("components"),
        "size": surface.size,
        "repair": surface.repair,
    }


def _measured(file: MeshFile, settings: LabelSettings, device: Device) -> dict[str, Any]:
    """Return the measures of a shell."""
    mesh = connect(mesh_of_file(file, device))
    topology, quality, output = measure_topology(mesh), measure_quality(mesh), settings.output
    crossings = count_intersections(mesh) if output.finds_intersections else None
    extent = extent_section(quality, topology)
    return {
        "extent": {"area": extent["area"], "bounds": extent["bounds"]},
        "topology": topology_section(topology),
        "quality": quality_section(quality, measure_elements(mesh), crossings),
        "components": components_section(list_components(mesh) if output.report is not None else None),
    }


def _settings_section(settings: LabelSettings, device: Device) -> dict[str, Any]:
    """Return every setting under the name of its option, in one level."""
    output = asdict(settings.output) | {"normals": settings.output.has_normals and not settings.conforming}
    section = {"input": settings.input, "output": output.pop("path")}
    section |= {"labels": settings.labels, "conforming": settings.conforming}
    section |= {"label_names": settings.label_names}
    section |= asdict(settings.part) | {name: getattr(settings.mesh, name) for name in SIZES}
    return section | asdict(settings.read) | output | {"device": device.name, "threads": device.threads}
