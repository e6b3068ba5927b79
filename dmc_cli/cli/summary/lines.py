"""Tell in a line each what several summaries have."""

from collections.abc import Iterator
from typing import Any

MOST_LABELS = 40
"""Labels that have a line of the summary, at most."""

_SLOW_STAGES = (
    "compile",
    "read",
    "prepare",
    "surface",
    "smooth",
    "repair",
    "shells",
    "normals",
    "halfedges",
    "simplify",
    "remesh",
    "size",
    "relax",
    "report",
    "write",
)
"""Stages that the last line names, in the order of the run."""


def warnings(report: dict[str, Any]) -> Iterator[str]:
    """Yield each warning's sentence with its code, which `docs/formats.md` explains."""
    for sentence, code in zip(report.get("warnings", []), report.get("warning_codes", []), strict=True):
        yield f"{sentence} ({code})"


def mesh_line(mesh: dict[str, Any]) -> str:
    """Tell how many vertices and faces a mesh has, its area and volume."""
    unit = "" if mesh["unit"] == "voxel" else f" {mesh['unit']}"
    text = f"{mesh['vertices']} vertices, {mesh['quads']} quads"
    if mesh.get("triangles"):
        text += f", {mesh['triangles']} triangles"
    if mesh.get("area") is not None:
        text += f", area {mesh['area']:.6g}{unit and unit + '²'}"
    if mesh.get("volume") is not None:
        text += f", volume {mesh['volume']:.6g}{unit and unit + '³'}"
    return text


def size_lines(report: dict[str, Any]) -> Iterator[str]:
    """Tell how many quads were taken away, what stopped that, and how far the mesh is from the one before."""
    size = report.get("size")
    if not size:
        return
    asked = "" if size["quads_wanted"] is None else f", {size['quads_wanted']} asked for"
    sides = "" if size["edge_length"] is None else f", sides {number(size['edge_length'], 4)} mm on average"
    end = "" if size["stopped_by"] is None else f"; stopped by {size['stopped_by'].replace('_', '-')}"
    yield f"size      {size['quads']} of {size['quads_before']} quads{asked}{sides}{end}"
    if size["to_before"]:
        there, back = (
            f"{number(size[way]['mean'], 3)} mm on average, at most {number(size[way]['max'], 3)}"
            for way in ("to_before", "from_before")
        )
        bound = "" if size["max_error"] is None else f"; nowhere more than {size['max_error']:g}"
        yield f"          from the mesh before {there}; that from it {back}{bound}"


def repair_lines(report: dict[str, Any]) -> Iterator[str]:
    """Tell what became of faces that intersected, if there were any."""
    repair = report.get("repair")
    if repair and repair["pairs_before"]:
        left = f", {repair['left_surface']} of them off the surface" if repair["left_surface"] else ""
        yield (
            f"repair    {repair['pairs_before']} pair(s) of faces intersected, {repair['pairs_after']} do"
            f" now; {repair['moved']} vertices moved{left}"
        )


def topology_line(topology: dict[str, Any]) -> str:
    """Tell whether a mesh is manifold and closed, its components and genus."""
    edges, vertices = topology["non_manifold_edges"], topology["non_manifold_vertices"]
    loops = topology["boundary_loops"]
    parts = [
        f"not manifold ({edges} edge(s), {vertices} vertices)" if edges or vertices else "manifold",
        f"open ({loops} boundary loop(s))" if loops else "closed",
        f"{topology['components']} component(s)",
    ]
    if topology.get("genus") is not None:
        parts.append(f"genus {topology['genus']:g}")
    return ", ".join(parts)


def intersections(quality: dict[str, Any]) -> str:
    """Tell how many pairs of faces intersect."""
    found = quality["self_intersections"]
    return f"{found} pair(s) intersect" if found else "no two intersect"


def requirement_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield what is met of what was required in one line, and a line for each that is not."""
    verdicts = report.get("requirements", [])
    if met := [verdict["require"] for verdict in verdicts if verdict["met"]]:
        yield f"required  {', '.join(met)}: met"
    for verdict in verdicts:
        if not verdict["met"]:
            found = "no value" if verdict["found"] is None else number(verdict["found"], 6)
            yield f"required  {verdict['require']}: not met ({found} was found)"


def output_space(report: dict[str, Any]) -> str:
    """Name the axes of the mesh's coordinates, and their unit where it is not the usual one."""
    asked = report["settings"]["space"]
    if asked == "voxel":
        return "grid indices"
    if asked == "tkr":
        return "tkrRAS"
    name = space_name(report["input"]["space"] if asked == "native" else asked.upper())
    unit = report["mesh"]["unit"]
    return name if unit == "mm" else f"{name} in {unit}"


def space_name(space: str) -> str:
    """Return what a space is called."""
    return "no space" if space == "none" else space


def volume_line(volume: dict[str, Any]) -> str:
    """Return the size, type, spacing and space of a volume in one line."""
    size = " x ".join(str(count) for count in volume["shape"])
    spacing = " x ".join(f"{length:.4g}" for length in volume["spacing_mm"])
    return f"{size} nodes of {volume['dtype']}, {spacing} mm, {space_name(volume['space'])}"


def time_line(timings: dict[str, float]) -> str:
    """Tell how long a run took, and its slow stages."""
    stages = ", ".join(f"{name} {timings[name] / 1000:.2f}" for name in _SLOW_STAGES if timings.get(name))
    total = f"{timings['total'] / 1000:.2f} s"
    return f"{total} ({stages})" if stages else total


def number(value: float | None, digits: int = 2) -> str:
    """Return a number with so many digits, `unknown` for none."""
    return "unknown" if value is None else f"{value:.{digits}g}"


def thickness_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield how thick the walls are, and how much is thinner than was asked for, where they were measured."""
    thickness, unit = report.get("thickness"), report["mesh"]["unit"]
    if not thickness:
        return
    if not thickness["vertices"]:
        yield "thickness unknown: no ray from a vertex meets a wall"
        return
    least, median = number(thickness["min"], 3), number(thickness["median"], 3)
    text = f"thickness at least {least} {unit}, of half the area at most {median} {unit}"
    if thickness["limit"] is not None:
        text += f"; {thickness['percent_below']:.2f} % of the area below {thickness['limit']:g} {unit}"
    yield text
