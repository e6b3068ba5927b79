"""Summarise what became of a mesh of a file."""

from collections.abc import Iterator
from typing import Any

from dmc_cli.cli.summary.lines import (
    intersections,
    mesh_line,
    repair_lines,
    requirement_lines,
    size_lines,
    space_name,
    thickness_lines,
    time_line,
    topology_line,
    warnings,
)


def rework_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc mesh`; what the report does not hold is left out."""
    yield from (f"warning: {warning}" for warning in warnings(report))
    read, mesh = report["input"], report["mesh"]
    yield f"read      {read['vertices']} vertices, {read['faces']} faces"
    unit = "" if mesh["unit"] == "mm" else f" in {mesh['unit']}"
    yield f"mesh      {mesh_line(mesh)}, {space_name(mesh['space'])}{unit}"
    yield from repair_lines(report)
    yield from size_lines(report)
    if topology := report["topology"]:
        yield f"topology  {topology_line(topology)}"
    if quality := report["quality"]:
        yield f"faces     {intersections(quality)}"
    yield from thickness_lines(report)
    yield from requirement_lines(report)
    yield f"time      {time_line(report['timings_ms'])}"
