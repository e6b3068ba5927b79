"""Describe an input."""

from collections.abc import Iterator, Sequence
from typing import Any

from dmc_cli.cli.histogram import histogram_lines
from dmc_cli.cli.summary.lines import MOST_LABELS, number, volume_line, warnings
from dmc_cli.printable import short_number

_MOST_VOLUMES = 100
"""Volumes of a file that are shown, at most."""

_MOST_COMPONENTS = 20
"""Components that are shown, at most."""

_BAR = 24
"""Characters of the longest bar in a table."""


def info_lines(description: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc info`."""
    yield f"path      {description['path']}"
    if "shape" in description:
        yield f"format    {description['format']}, {description['files']} file(s)"
        yield f"volume    {volume_line(description)}"
        ends = description["value_range"]
        yield "values    " + ("none that is finite" if ends is None else f"{ends[0]:g} to {ends[1]:g}")
        if "kind" in description:
            yield f"kind      {description['kind']}"
        rows = description.get("labels", [])
        for row in rows[:MOST_LABELS]:
            yield f"label     {_label(row)}: {row['nodes']} nodes"
        if len(rows) > MOST_LABELS:
            yield f"          and {len(rows) - MOST_LABELS} more; --json has them all"
        if (description["slope"], description["intercept"]) != (1.0, 0.0):
            yield f"scaling   {description['slope']:g} * stored value + {description['intercept']:g}"
        yield "affine    " + _matrix(description["affine"])
    if len(description["series"]) > 1 and "shape" not in description:
        yield "series    choose one with --series"
    dicom = len(description["series"]) > 1 or any(entry["uid"] for entry in description["series"])
    for entry in description["series"] if dicom else ():
        size = " x ".join(str(count) for count in entry["size"])
        parts = [f"{entry['number']:<4}", entry["modality"], size, entry["description"], entry["uid"]]
        yield "  " + "  ".join(part for part in parts if part)
    for entry in description["series"]:
        if len(entry["volumes"]) > 1:
            yield "volumes   choose one with --volume-index"
            shown = entry["volumes"][:_MOST_VOLUMES]
            yield from (f"  {number:<4}  {volume}" for number, volume in enumerate(shown))
            if len(entry["volumes"]) > len(shown):
                yield f"  and {len(entry['volumes']) - len(shown)} more; --json has them all"
    yield from _suggestion_lines(description)
    yield from _spectrum_lines(description.get("isovalues", []))
    for found in description.get("components", []):
        yield from _component_lines(found)
    yield from (f"warning   {warning}" for warning in warnings(description))


def _suggestion_lines(description: dict[str, Any]) -> Iterator[str]:
    """Yield the isovalues that the values suggest, and their histogram with these marked."""
    suggested = description.get("suggested_isovalues", [])
    if suggested:
        told = ", ".join(f"{one['choice']} ({number(one['isovalue'], 6)})" for one in suggested)
        yield f"isovalues {told}; the first one is taken without -i"
    if description.get("histogram") and not {"isovalues", "components"} & description.keys():
        yield from histogram_lines(description["histogram"], suggested)


def _component_lines(found: dict[str, Any]) -> Iterator[str]:
    """Yield the components of an object, the largest first."""
    told = f"{found['count']} component(s) at or above {short_number(found['isovalue'])}"
    yield f"parts     {told}, {found['specks']} of them specks under {number(found['speck_volume'], 3)} mm³"
    if found["listed"]:
        yield "           nodes        mm³  from x y z to x y z, mm"
    for one in found["listed"][:_MOST_COMPONENTS]:
        low, high = (" ".join(f"{end:.6g}" for end in ends) for ends in one["bounds"])
        yield f"  {one['nodes']:>14}  {one['volume']:>9.6g}  {low} to {high}"
    if found["count"] > _MOST_COMPONENTS:
        yield f"  and {found['count'] - _MOST_COMPONENTS} more; --json lists the largest thousand"


def _spectrum_lines(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield a table of the surfaces over the range of values, the area as a bar beside it."""
    if not rows:
        return
    yield "  isovalue  active cells       %      area mm²  components"
    largest = max(row["area_mm2"] for row in rows)
    for row in rows:
        bar = "█" * round(_BAR * row["area_mm2"] / largest) if largest else ""
        yield (
            f"{short_number(row['isovalue']):>10}  {row['active_cells']:>12}  {row['active_percent']:6.2f}"
            f"  {row['area_mm2']:>12.6g}  {row['components']:>10}  {bar}".rstrip()
        )


def _label(row: dict[str, Any]) -> str:
    """Return a label's number, with its name where it has one."""
    return f"{row['label']} {row['name']}".strip()


def _matrix(rows: list[list[float]]) -> str:
    return "; ".join(" ".join(f"{value + 0.0:.6g}" for value in row) for row in rows[:3])
