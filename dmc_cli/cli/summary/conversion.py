"""Summarise conversions."""

from collections.abc import Iterator, Sequence
from typing import Any

from dmc_cli.cli.summary.lines import (
    intersections,
    mesh_line,
    number,
    output_space,
    repair_lines,
    requirement_lines,
    size_lines,
    thickness_lines,
    time_line,
    topology_line,
    volume_line,
    warnings,
)
from dmc_cli.cli.terminal import echo_lines


def echo_summaries(reports: Sequence[dict[str, Any]]) -> None:
    """Print what conversions of one input did to standard error; warnings and the volume stand there once."""
    told: set[str] = set()
    for report in reports:
        lines = [line for line in summary_lines(report) if line not in told]
        told.update(line for line in lines if line.startswith(("warning: ", "volume ")))
        echo_lines(lines, err=True)


def summary_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the summary; what the report does not hold is left out."""
    yield from (f"warning: {warning}" for warning in warnings(report))
    yield f"volume    {volume_line(report['input'])}"
    yield from part_lines(report.get("part"))
    yield f"surface   {_surface_line(report['surface'])}"
    yield from _choice_lines(report["surface"].get("choice"))
    yield f"mesh      {mesh_line(report['mesh'])}, {output_space(report)}"
    yield from repair_lines(report)
    yield from size_lines(report)
    if topology := report.get("topology"):
        yield f"topology  {topology_line(topology)}"
    quality = report.get("quality")
    if quality and quality["self_intersections"] is not None:
        yield f"faces     {intersections(quality)}"
    yield from thickness_lines(report)
    if deviation := report.get("deviation"):
        yield (
            f"deviation at most {number(deviation['max_relative'])} of the value range,"
            f" {number(deviation['max_mm'])} mm; rounding at most {number(deviation['rounding_mm'])} mm"
        )
    yield from requirement_lines(report)
    if timings := report.get("timings_ms"):
        yield f"time      {time_line(timings)}"


def _surface_line(surface: dict[str, Any]) -> str:
    choice = surface.get("choice")
    if choice and choice["band"]:
        low, high = choice["band"]
        mapped = f"min(value - {low:g}, {high:g} - value)".replace("- -", "+ ")
        return f"of what lies from {low:g} to {high:g}: isovalue 0 of the trilinear {mapped}"
    text = f"isovalue {surface['isovalue']:g}"
    if choice and choice["chosen"]:
        text += f" ({choice['chosen']})"
    if surface["stored_isovalue"] != surface["isovalue"]:
        text += f", cut at the stored value {surface['stored_isovalue']:g}"
    return text


def part_lines(part: dict[str, Any] | None) -> Iterator[str]:
    """Yield what was done to have a part of the volume."""
    if part is None:
        return
    if "table" in part:
        done = part["table"]
        size = f"{done['nodes']} nodes, {number(done['volume'], 6)} mm³"
        found = f"{done['components']} piece(s) cut: {size}" if done["components"] else "none found"
        yield f"part      table: {found}"
    if "filtered" in part:
        size, spacing = (part["filtered"][key] for key in ("shape", "spacing"))
        yield (
            f"part      values at {' x '.join(map(str, size))} nodes,"
            f" {' x '.join(f'{length:.4g}' for length in spacing)} mm apart"
        )
    for key, name in (("opened", "taken away"), ("closed", "filled in gaps")):
        if key in part:
            yield f"part      {part[key]['nodes']} nodes {name}, {number(part[key]['volume'], 6)} mm³"
    for key, name in (("dropped", "component(s) dropped"), ("filled", "cavit(ies) filled")):
        if key in part:
            done = part[key]
            what = name.replace("cavit(ies)", "cavity" if done["components"] == 1 else "cavities")
            size = f"{done['nodes']} nodes, {number(done['volume'], 6)} mm³"
            yield f"part      {done['components']} {what}: {size}"
    if "dropped" not in part and part.get("components", {}).get("specks"):
        yield _speck_line(part["components"])


def _speck_line(found: dict[str, Any]) -> str:
    """Tell how many components are specks, and how they are dropped."""
    limit = number(found["speck_volume"], 3)
    return (
        f"part      {found['count']} components, {found['specks']} of them specks under {limit} mm³; --keep"
        f" largest drops all but one, --min-volume {limit} the specks"
    )


def _choice_lines(choice: dict[str, Any] | None) -> Iterator[str]:
    """Yield why an isovalue was chosen where none was asked for, and what else there is."""
    if choice is None or choice["asked"] is not None:
        return
    others = [f"{name} ({number(isovalue, 6)})" for name, isovalue in choice["others"].items()]
    if "otsu" not in (choice["chosen"], *choice["others"]):
        others.append("otsu")
    told = f"{choice['chosen']} is the default{', ' + choice['reason'] if choice['reason'] else ''}"
    yield f"isovalue  {told}; others by -i: {', '.join(others)} or a number; dmc info draws them"
