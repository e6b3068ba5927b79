"""Show the table of a comparison: as text for a terminal, CSV, or Markdown."""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

Row = dict[str, Any]

Tunnels = Mapping[str, Sequence[Mapping[str, Any]]]
"""Where a method closes tunnels, as `Comparison.tunnels` tells."""

Columns = tuple[tuple[str, str, str], ...]
"""Of each column its heading, the key in a row, and how a number is written."""

WIDTH = 80
"""Of a line at most, while a column fits."""

COUNTS: Columns = (
    ("vertices", "vertices", "d"),
    ("quads", "quads", "d"),
    ("triangles", "triangles", "d"),
    ("ms", "surface_ms", ".1f"),
    ("x fastest", "time_ratio", ".2f"),
    ("MiB", "memory_mib", ".1f"),
)
"""The first part of the table."""

SHAPES: Columns = (
    ("mean mm", "deviation_mean_mm", ".2g"),
    ("max mm", "deviation_max_mm", ".2g"),
    ("shape", "shape_mean", ".3f"),
    ("ratio", "mean_ratio_mean", ".3f"),
    ("radii", "radius_ratio_mean", ".3f"),
    ("least", "radius_ratio_min", ".2g"),
    ("angle", "min_angle", ".3g"),
    ("irregular", "irregular_percent", ".2f"),
)
"""The second part."""

TOPOLOGY: Columns = (
    ("parts", "components", "d"),
    ("Euler", "euler_characteristic", "d"),
    ("off", "euler_difference", "+d"),
    ("tunnels", "tunnels_closed", "d"),
    ("flips", "flipped_faces", "d"),
    ("edges", "non_manifold_edges", "d"),
    ("corners", "non_manifold_vertices", "d"),
    ("intersections", "self_intersections", "d"),
)
"""The third part."""

PARTS = (COUNTS, SHAPES, TOPOLOGY)

LEGEND = (
    "ms: of extraction alone; mean mm, max mm: of the vertices from the surface;",
    "shape: equation 9, of quads; ratio, radii: mean ratio and radius ratio of",
    "triangles, quads split by the MaxMin-angle criterion; least: radius ratio;",
    "angle: the least, in degrees; irregular: vertices, in %; parts: components;",
    "off: Euler characteristic less that of the trilinear surface; tunnels: of that",
    "surface inside a cell, closed; flips: faces decided otherwise, each a tunnel",
    "through two cells closed or a bridge cut; edges, corners: not manifold;",
    "intersections: pairs of faces",
)

SHOWN = 8
"""Places of tunnels that are listed; JSON has more."""


def text_table(rows: Sequence[Row], tunnels: Tunnels) -> Iterator[str]:
    """Yield the lines of the table in parts as wide as a terminal, and what the columns are."""
    for part in PARTS:
        columns = [["method", *(row["method"] for row in rows)]]
        for heading, key, form in part:
            columns.append([heading, *(_shown(row, key, form) for row in rows)])
        for some in _fitting(columns):
            for first, *others in zip(*some, strict=True):
                yield "  ".join([first, *others]).rstrip()
            yield ""
    yield from LEGEND
    yield from _tunnel_lines(rows, tunnels)


def _fitting(columns: list[list[str]]) -> Iterator[list[list[str]]]:
    """Yield the columns, padded, in lots that fit a line, each behind the first column."""
    names, *rest = columns
    width = max(map(len, names))
    first = [name.ljust(width) for name in names]
    lot, taken = [first], width
    for column in rest:
        own = max(map(len, column))
        if taken + 2 + own > WIDTH and len(lot) > 1:
            yield lot
            lot, taken = [first], width
        lot.append([entry.rjust(own) for entry in column])
        taken += 2 + own
    yield lot


def _tunnel_lines(rows: Sequence[Row], tunnels: Tunnels) -> Iterator[str]:
    """Yield which tunnels the first method that closes any does not have, and where, a few of them."""
    for row in rows:
        places = tunnels.get(row["method"], ())
        if not places:
            continue
        inside, flips = row["tunnels_closed"], row["flipped_faces"]
        yield ""
        told = [f"closes {inside} {_plural('tunnel', inside)} inside a cell"] if inside else []
        told += [f"has {flips} flipped {_plural('face', flips)}"] if flips else []
        yield f"{row['method']} {' and '.join(told)}:"
        for place in places[:SHOWN]:
            yield f"  {_place(place)}"
        if inside + flips > SHOWN:
            yield f"  and {inside + flips - SHOWN} more; --format json lists them"
        return


def _plural(word: str, count: int) -> str:
    """Return the word for that many."""
    return word if count == 1 else f"{word}s"


def _place(place: Mapping[str, Any]) -> str:
    """Return where a tunnel is, in words."""
    cell = ", ".join(map(str, place["cell"]))
    face = "" if place["face"] is None else f", high face across {place['face']}"
    point = ", ".join(format(each, ".6g") for each in place["position"])
    return f"cell {cell}{face}, at {point} mm"


def markdown_table(rows: Sequence[Row], tunnels: Tunnels) -> Iterator[str]:
    """Yield the lines of one table in Markdown."""
    columns = [column for part in PARTS for column in part]
    yield "| method | " + " | ".join(heading for heading, _, _ in columns) + " |"
    yield "| --- |" + " ---: |" * len(columns)
    for row in rows:
        shown = " | ".join(_shown(row, key, form) for _, key, form in columns)
        yield f"| {row['method']} | {shown} |"
    yield ""
    yield from LEGEND
    lines = list(_tunnel_lines(rows, tunnels))
    yield from (f"- {line.strip()}" if line.startswith(" ") else line for line in lines)


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
