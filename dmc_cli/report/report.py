"""Report a run: everything that was found, under the keys that scripts rely on.

The order of the keys is fixed, no value is NaN or infinity, and a section that was not measured is null.
`docs/report-schema.json` describes every key.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from dmc_cli.contouring import SurfaceCounts
from dmc_cli.measures import plain
from dmc_cli.notices import Notice, warning_keys
from dmc_cli.printable import json_text
from dmc_cli.settings import ConvertSettings
from dmc_cli.volume import Volume

if TYPE_CHECKING:  # their kernels are only imported by runs that measure
    from dmc_cli.measures import Component, Curvature, Deviation, Elements, Quality, Thickness, Topology

SCHEMA = 1
"""Version of the report; it grows when a key changes its meaning or goes."""

HASHED_AT_ONCE = 1 << 20
"""Bytes read at a time for the input's checksum."""


@dataclass(frozen=True, kw_only=True)
class Measures:
    """What is measured only if a report, a requirement or a check asks for it."""

    topology: "Topology"
    quality: "Quality"
    elements: "Elements"
    self_intersections: int | None
    deviation: "Deviation"
    curvature: "Curvature | None" = None
    components: "list[Component] | None" = None
    thickness: "Thickness | None" = None


@dataclass(frozen=True, kw_only=True)
class RunFacts:
    """What a conversion knows at its end.

    Attributes:
        volume: The input.
        settings: What was asked for.
        resolved: Settings by name that took a value of their own, for example the device behind `auto`.
        stored_isovalue: The level that was cut, in stored values.
        counts: What the surface stage found.
        vertex_count: Vertices of the mesh as it is written.
        quad_count: Its quads.
        triangle_count: Its triangles.
        choice: How the isovalue was chosen, or None where it was given as a number.
        part: What was done to have a part of the volume, or None where the whole was wanted.
        measures: Topology, quality and deviation of the mesh, or None if they were not asked for.
        simplification: What simplification did, or None if there was none.
        repair: What became of faces that intersected, or None if nobody looked.
        size: What became of the size that was asked for, or None if there was none.
        warnings: What else the user is told, after the volume's own.
        timings_ms: Milliseconds by stage.
        memory: As `measure_memory` returns it.
        versions: As `collect_versions` returns it.
    """

    volume: Volume
    settings: ConvertSettings
    resolved: Mapping[str, Any]
    stored_isovalue: float
    counts: SurfaceCounts
    vertex_count: int
    quad_count: int
    triangle_count: int
    measures: Measures | None
    choice: Mapping[str, Any] | None = None
    part: Mapping[str, Any] | None = None
    simplification: Mapping[str, Any] | None = None
    repair: Mapping[str, int] | None = None
    size: Mapping[str, Any] | None = None
    warnings: tuple[Notice, ...] = ()
    timings_ms: Mapping[str, float]
    memory: Mapping[str, int | None]
    versions: Mapping[str, str]


def build_report(facts: RunFacts) -> dict[str, Any]:
    """Return the report as plain dicts, lists, strings and numbers, keys in a fixed order.

    No requirement is judged yet: `check_requirements` does that.
    """
    measures = facts.measures
    report = {
        "schema": SCHEMA,
        **warning_keys([*facts.volume.warnings, *_own_warnings(facts.counts), *facts.warnings]),
        "input": input_section(
            facts.volume, with_hash=measures is not None, no_data_nodes=facts.counts.no_data_nodes
        ),
        "settings": _settings_section(facts.settings, facts.resolved),
        "part": facts.part,
        "surface": _surface_section(facts),
        "mesh": _mesh_section(facts),
        **measured_sections(measures),
        "requirements": [],
        "curvature": asdict(measures.curvature) if measures and measures.curvature else None,
        "thickness": asdict(measures.thickness) if measures and measures.thickness else None,
        "components": components_section(measures.components if measures else None),
        "simplification": facts.simplification,
        "repair": facts.repair,
        "size": facts.size,
        "timings_ms": {stage: round(time, 3) for stage, time in facts.timings_ms.items()},
        "memory": facts.memory,
        "versions": facts.versions,
    }
    return {key: plain(section) for key, section in report.items()}


def report_text(report: Mapping[str, Any]) -> str:
    """Return a report as JSON, indented, with a newline at its end."""
    return json_text(report, indent=2) + "\n"


def measured_sections(measures: Measures | None) -> dict[str, Any]:
    """Return the sections `topology`, `quality` and `deviation`, None where nothing was measured.

    A report on simplification holds those of the mesh before it, too.
    """
    if measures is None:
        return {"topology": None, "quality": None, "deviation": None}
    return {
        "topology": topology_section(measures.topology),
        "quality": quality_section(measures.quality, measures.elements, measures.self_intersections),
        "deviation": asdict(measures.deviation),
    }


def components_section(components: "list[Component] | None") -> list[dict[str, Any]] | None:
    """Return the section `components`, None where they are not listed."""
    return None if components is None else [asdict(component) for component in components]


def topology_section(topology: "Topology") -> dict[str, Any]:
    """Return the section `topology`: every field, in the order of the class."""
    return asdict(topology)


def quality_section(
    quality: "Quality", elements: "Elements", self_intersections: int | None
) -> dict[str, Any]:
    """Return the section `quality`: every field but those that belong to the section `mesh`."""
    shape = asdict(quality)
    for key in ("area", "signed_volume", "bounds"):
        del shape[key]
    return shape | asdict(elements) | {"self_intersections": self_intersections}


def extent_section(quality: "Quality", topology: "Topology") -> dict[str, Any]:
    """Return area, enclosed volume and bounds; the volume is None if the mesh has a boundary."""
    encloses = topology.is_closed and topology.components > 0
    return {
        "area": quality.area,
        "volume": quality.signed_volume if encloses else None,
        "bounds": quality.bounds,
    }


def _mesh_section(facts: RunFacts) -> dict[str, Any]:
    measures = facts.measures
    section: dict[str, Any] = {
        "vertices": facts.vertex_count,
        "quads": facts.quad_count,
        "triangles": facts.triangle_count,
    }
    output = facts.settings.output
    unit = {"unit": "voxel" if output.space == "voxel" else output.unit}
    if measures is None:
        return section | {"area": None, "volume": None, "bounds": None} | unit
    return section | extent_section(measures.quality, measures.topology) | unit


def input_section(volume: Volume, *, with_hash: bool, **counts: int) -> dict[str, Any]:
    """Return the section `input`: the volume, what was counted, and a checksum that takes a while."""
    return {
        "path": volume.path,
        "files": [str(file) for file in volume.files],
        "format": volume.format,
        "shape": volume.shape,
        "dtype": volume.values.dtype.name,
        "spacing_mm": volume.spacing,
        "space": volume.space,
        "affine": volume.affine,
        **counts,
        "sha256": _sha256(volume) if with_hash else None,
    }


def _sha256(volume: Volume) -> str | None:
    """Return the checksum of the input if it is a single regular file."""
    if len(volume.files) != 1 or not volume.files[0].is_file():
        return None
    digest = hashlib.sha256()
    with volume.files[0].open("rb") as file:
        while piece := file.read(HASHED_AT_ONCE):
            digest.update(piece)
    return digest.hexdigest()


def _settings_section(settings: ConvertSettings, resolved: Mapping[str, Any]) -> dict[str, Any]:
    """Return every setting under the name of its option, in one level."""
    output = asdict(settings.output)
    section = {"input": settings.input, "output": output.pop("path")}
    section |= (
        asdict(settings.surface)
        | asdict(settings.part)
        | asdict(settings.mesh)
        | asdict(settings.read)
        | output
    )
    section |= {"device": settings.device, "threads": settings.threads}
    return section | dict(resolved)


def _surface_section(facts: RunFacts) -> dict[str, Any]:
    counts = asdict(facts.counts)
    del counts["no_data_nodes"]
    chosen = facts.settings.surface
    found = {"method": chosen.method, "isovalue": chosen.isovalue, "stored_isovalue": facts.stored_isovalue}
    return found | {"choice": facts.choice} | counts


def _own_warnings(counts: SurfaceCounts) -> list[Notice]:
    """Return the warnings about the surface, in the order of the report."""
    if not counts.no_data_nodes:
        return []
    told = f"{counts.no_data_nodes} nodes hold no data (NaN, infinity or padding); the surface ends there"
    return [Notice("W-NO-DATA", told)]
