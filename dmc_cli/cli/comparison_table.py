"""Show the table of a comparison: as text for a terminal, CSV, or Markdown."""

import csv
import io
from collections.abc import Iterator, Sequence
from typing import Any

Row = dict[str, Any]

COUNTS = (
    ("vertices", "vertices", "d"),
    ("quads", "quads", "d"),
    ("triangles", "triangles", "d"),
    ("ms", "surface_ms", ".1f"),
    ("x fastest", "time_ratio", ".2f"),
    ("MiB", "memory_mib", ".1f"),
    ("deviation", "deviation_mean_mm", ".2g"),
    ("max mm", "deviation_max_mm", ".2g"),
)
"""The first part of the table: heading, key, and how a number is written."""

SHAPES = (
    ("shape", "shape_mean", ".3f"),
    ("ratio", "mean_ratio_mean", ".3f"),
    ("radii", "radius_ratio_mean", ".3f"),
    ("least", "radius_ratio_min", ".2g"),
    ("angle", "min_angle", ".3g"),
    ("irregular %", "irregular_percent", ".2f"),
    ("bad edges", "non_manifold_edges", "d"),
    ("bad vertices", "non_manifold_vertices", "d"),
    ("intersections", "self_intersections", "d"),
    ("components", "components", "d"),
    ("Euler", "euler_characteristic", "d"),
    ("off", "euler_difference", "+d"),
)
"""The second part."""

LEGEND = (
    "deviation: mean distance from the surface in mm; shape: equation 9, of quads; ratio, radii: mean ratio",
    "and radius ratio of triangles, quads split by the MaxMin-angle criterion; angle: the least, in degrees;",
    "bad: non-manifold; off: Euler characteristic less that of the trilinear surface",
)


def text_table(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of the table in two parts, each as wide as a terminal, and what the columns are."""
    for part in (COUNTS, SHAPES):
        cells = [["method", *(heading for heading, _, _ in part)]]
        cells += [[row["method"], *(_shown(row, key, form) for _, key, form in part)] for row in rows]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        for line in cells:
            first, *others = line
            shown = [each.rjust(width) for each, width in zip(others, widths[1:], strict=True)]
            yield "  ".join([first.ljust(widths[0]), *shown]).rstrip()
        yield ""
    yield from LEGEND


def markdown_table(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of one table in Markdown."""
    columns = (*COUNTS, *SHAPES)
    yield "| method | " + " | ".join(heading for heading, _, _ in columns) + " |"
    yield "| --- |" + " ---: |" * len(columns)
    for row in rows:
        shown = " | ".join(_shown(row, key, form) for _, key, form in columns)
        yield f"| {row['method']} | {shown} |"
    yield ""
    yield from LEGEND


def csv_table(rows: Sequence[Row]) -> str:
    """Return the table as comma-separated values, all columns by their keys in the JSON."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _shown(row: Row, key: str, form: str) -> str:
    """Return an entry as text; `memory_mib` is the row's memory in that unit."""
    if key == "memory_mib":
        value = None if row["memory_bytes"] is None else row["memory_bytes"] / 2**20
    else:
        value = row[key]
    return "-" if value is None else format(value, form)
