"""All methods of contouring on all real volumes: counts, time, memory, deviation, shape, topology.

    python benchmarks/volumes.py [--only NAME] [--repeats 3] [--out NAME]

What `dmc compare` tells, of every volume of shared data (`DMC_DATA`; benchmarks/scans.py lists them, and
which are left out), cut at the isovalues of its catalogue, with an open border, on two threads. Times are
ratios: the methods take turns, so that other work on the machine meets all of them. A row is printed as it is
found; --out adds a line to benchmarks/results/NAME.jsonl and writes NAME.md anew, with the best methods of
each column, in words where that is not dual marching cubes.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from history import record
from scans import LEFT_OUT, SCANS, Scan

from dmc_cli.app import Comparison, compare_methods
from dmc_cli.contouring import extract_surface
from dmc_cli.errors import DmcError
from dmc_cli.field import upload_volume
from dmc_cli.measures import measure_topology
from dmc_cli.settings import CompareSettings

Row = dict[str, Any]

OURS = "dmc"

THREADS = 2

ON_SURFACE = 1e-6
"""Millimetres below which vertices lie on the surface: the rest is rounding."""

COLUMNS: tuple[tuple[str, str, str], ...] = (
    ("vertices", "vertices", "d"),
    ("faces", "faces", "d"),
    ("time", "time_ratio", ".2f"),
    ("MiB", "memory_mib", ".1f"),
    ("mean mm", "deviation_mean_mm", ".2g"),
    ("max mm", "deviation_max_mm", ".2g"),
    ("shape", "shape_mean", ".3f"),
    ("ratio", "mean_ratio_mean", ".3f"),
    ("radii", "radius_ratio_mean", ".3f"),
    ("least", "radius_ratio_min", ".2g"),
    ("angle", "min_angle", ".3g"),
    ("irregular", "irregular_percent", ".2f"),
    ("parts", "components", "d"),
    ("off", "euler_difference", "+d"),
    ("off, closed", "closed_difference", "+d"),
    ("tunnels", "tunnels_closed", "d"),
    ("flips", "flipped_faces", "d"),
    ("edges", "non_manifold_edges", "d"),
    ("corners", "non_manifold_vertices", "d"),
    ("intersections", "self_intersections", "d"),
)
"""Of each column its heading, its key in a row, and how a number is written."""

JUDGED: tuple[tuple[str, str, Callable[[float], float]], ...] = (
    ("time of extraction", "time_ratio", lambda value: value),
    ("memory", "memory_mib", lambda value: value),
    ("mean distance from the surface", "deviation_mean_mm", lambda value: max(value, ON_SURFACE)),
    ("greatest distance from the surface", "deviation_max_mm", lambda value: max(value, ON_SURFACE)),
    ("mean shape of quads (equation 9)", "shape_mean", lambda value: -value),
    ("mean ratio of triangles (equation 8)", "mean_ratio_mean", lambda value: -value),
    ("mean radius ratio of triangles", "radius_ratio_mean", lambda value: -value),
    ("least radius ratio", "radius_ratio_min", lambda value: -value),
    ("least angle", "min_angle", lambda value: -value),
    ("irregular vertices", "irregular_percent", lambda value: value),
    ("Euler characteristic of the trilinear surface, closed", "closed_difference", abs),
    ("non-manifold edges", "non_manifold_edges", lambda value: value),
    ("non-manifold vertices", "non_manifold_vertices", lambda value: value),
    ("self-intersections", "self_intersections", lambda value: value),
)
"""What is judged, its key, and what of its value is to be small."""


def rows_of(scan: Scan, isovalue: float, repeats: int) -> list[Row]:
    """Compare all methods on a volume; a row for each."""
    settings = CompareSettings(
        input=scan.file,
        isovalue=isovalue,
        read=scan.read,
        repeats=repeats,
        device="cpu",
        threads=THREADS,
    )
    comparison = compare_methods(settings)
    rows = comparison.rows()
    closed = closed_differences(comparison)
    for row in rows:
        memory = row["memory_bytes"]
        row |= {"volume": scan.name, "isovalue": isovalue, "faces": row["quads"] + row["triangles"]}
        row["closed_difference"] = closed[row["method"]]
        row["memory_mib"] = None if memory is None else memory / 2**20
    return rows


def closed_differences(comparison: Comparison) -> dict[str, int]:
    """The Euler characteristics less that of the trilinear surface, of surfaces closed at the border."""
    settings = replace(comparison.settings, border="closed")
    volume = upload_volume(comparison.volume, comparison.methods[0].mesh.device)

    def euler(method: str) -> int:
        return measure_topology(
            extract_surface(volume, settings.surface_of(method)).mesh
        ).euler_characteristic

    exact = euler("tmc")
    return {method: euler(method) - exact for method in settings.methods}


def table_of(rows: Sequence[Row]) -> str:
    """One table in Markdown."""
    lines = ["| volume, isovalue | method | " + " | ".join(heading for heading, _, _ in COLUMNS) + " |"]
    lines.append("| --- | --- |" + " ---: |" * len(COLUMNS))
    for row in rows:
        cells = ["-" if row[key] is None else format(row[key], form) for _, key, form in COLUMNS]
        lines.append(f"| {row['volume']}, {row['isovalue']:g} | {row['method']} | {' | '.join(cells)} |")
    return "\n".join(lines)


def best_of(rows: Sequence[Row], key: str, small: Callable[[float], float]) -> set[str]:
    """The methods of one surface that are the best in a column, to three digits."""
    values = {row["method"]: small(row[key]) for row in rows if row[key] is not None}
    best = min(values.values())
    return {method for method, value in values.items() if format(value, ".3g") == format(best, ".3g")}


def wins_of(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    """On how many surfaces each method is the best, or as good, by what is judged."""
    surfaces: dict[tuple[str, float], list[Row]] = {}
    for row in rows:
        surfaces.setdefault((row["volume"], row["isovalue"]), []).append(row)
    methods = list(dict.fromkeys(row["method"] for row in rows))
    wins = {}
    for title, key, small in JUDGED:
        best = [best_of(own, key, small) for own in surfaces.values()]
        wins[title] = {method: sum(method in each for each in best) for method in methods}
    return wins


def words_of(wins: dict[str, dict[str, int]], count: int) -> str:
    """What the columns' best methods are: a table, and a sentence for each where ours is not everywhere."""
    methods = list(next(iter(wins.values())))
    lines = [f"| best, or as good, on how many of {count} surfaces | " + " | ".join(methods) + " |"]
    lines.append("| --- |" + " ---: |" * len(methods))
    lines += [f"| {title} | " + " | ".join(map(str, own.values())) + " |" for title, own in wins.items()]
    lines += ["", "Where dual marching cubes is not the best:", ""]
    for title, own in wins.items():
        others = {method: number for method, number in own.items() if method != OURS}
        most = max(others, key=lambda method: others[method])
        if own[OURS] < count:
            beaten = f"; {most} on {own[most]}" if own[most] > own[OURS] else ", no other on more"
            lines.append(f"- {title}: {OURS} is the best on {own[OURS]} of {count}{beaten}.")
    everywhere = [title for title, own in wins.items() if own[OURS] == count]
    lines += [
        "",
        f"On all {count} it is the best, alone or with others, by: {', '.join(everywhere) or 'nothing'}.",
    ]
    return "\n".join(lines)


LEGEND = """\
time: of extraction, times that of the fastest in the same run, in which the methods take turns; mean, max mm:
distance of the vertices from the trilinear surface; shape: of quads; ratio, radii: mean ratio and radius
ratio of triangles, quads split by the MaxMin-angle criterion; least: radius ratio; angle: the least, in
degrees; irregular: vertices whose valence is not 4, of triangles not 6, in %; parts: components; off: Euler
characteristic less that of the trilinear surface, and the same of surfaces that are closed at the volume's
border, where a mesh of quads does not end half a cell earlier; tunnels: closed inside cells; flips: faces
decided otherwise to be manifold; edges, corners: not manifold; intersections: pairs of faces."""


def report_of(rows: Sequence[Row], failed: Sequence[str]) -> str:
    """All of the file: words, the table, what is left out."""
    count = len({(row["volume"], row["isovalue"]) for row in rows})
    parts = [words_of(wins_of(rows), count), "", LEGEND, "", table_of(rows), "", "Left out:", ""]
    parts += [f"- {each}" for each in (*LEFT_OUT, *failed)]
    return "\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="", help="volumes whose name has this in it")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", help="name of the files in benchmarks/results")
    chosen = parser.parse_args()
    rows: list[Row] = []
    failed = []
    for scan in SCANS:
        if chosen.only not in scan.name:
            continue
        if not Path(scan.file).exists():
            failed.append(f"{scan.name}: not there")
            continue
        for isovalue in scan.isovalues:
            try:
                found = rows_of(scan, isovalue, chosen.repeats)
            except DmcError as error:
                failed.append(f"{scan.name}, {isovalue:g}: {error}")
                print(failed[-1], flush=True)
                continue
            rows += found
            print(table_of(found), flush=True)
    report = report_of(rows, failed)
    print(report)
    if chosen.out:
        keys = ("volume", "isovalue", "method", *(key for _, key, _ in COLUMNS))
        kept = [{key: row[key] for key in keys} for row in rows]
        record(chosen.out, {"rows": kept}, "All methods on all volumes", report)


if __name__ == "__main__":
    main()
