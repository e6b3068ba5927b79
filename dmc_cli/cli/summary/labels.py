"""Summarise the surfaces of labels."""

from collections.abc import Iterator
from typing import Any

from dmc_cli.cli.summary.conversion import part_lines
from dmc_cli.cli.summary.lines import MOST_LABELS, mesh_line, output_space, time_line, volume_line, warnings


def label_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the summary of a label map: a line a label."""
    yield from (f"warning: {warning}" for warning in warnings(report))
    yield f"volume    {volume_line(report['input'])}"
    rows = report["labels"]
    yield from part_lines(_part_of_all(rows))
    yield f"mesh      {mesh_line(report['mesh'])}, {output_space(report)}; {len(rows)} label(s)"
    for row in rows[:MOST_LABELS]:
        mesh, change = row["mesh"], row["mesh"]["volume_change_percent"]
        name = "" if row["name"] == f"label_{row['label']}" else f" {row['name']}"
        before = f" of {row['size']['quads_before']}" if row["size"] else ""
        told = "" if change is None else f", {round(change, 3) + 0.0:+.3f} % against its nodes"
        yield (
            f"label     {row['label']}{name}: {row['nodes']} nodes, {mesh['quads']}{before} quads, volume"
            f" {mesh['volume']:.6g}{told}"
        )
    if len(rows) > MOST_LABELS:
        yield f"          and {len(rows) - MOST_LABELS} more; --report has them all"
    if timings := report.get("timings_ms"):
        yield f"time      {time_line(timings)}"


def _part_of_all(rows: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return what was done to have a part of the labels, summed over all; None where nothing was."""
    total: dict[str, Any] = {}
    for row in rows:
        for name, done in (row["part"] or {}).items():
            if name != "components":
                sums = total.setdefault(name, dict.fromkeys(done, 0))
                for key, number in done.items():
                    sums[key] += number
    return total or None
