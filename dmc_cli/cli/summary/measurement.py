"""Summarise the measures of a mesh."""

from collections.abc import Iterator
from typing import Any

from dmc_cli.cli.summary.lines import (
    intersections,
    mesh_line,
    number,
    requirement_lines,
    thickness_lines,
    topology_line,
    warnings,
)

_WORST = (("aspect ratio", "aspect_ratio"), ("skew", "skew"), ("taper", "taper"))
"""Measures of quads whose largest value is the worst, and their keys."""


def measure_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc measure`."""
    yield from (f"warning   {warning}" for warning in warnings(report))
    mesh, topology, quality = report["mesh"], report["topology"], report["quality"]
    yield f"mesh      {mesh_line(mesh)}"
    yield f"topology  {topology_line(topology)}, Euler characteristic {topology['euler_characteristic']}"
    histogram = ", ".join(f"{count} of {valence}" for valence, count in topology["valence_histogram"].items())
    yield f"valences  {histogram}; {topology['irregular_percent']:.2f} % irregular"
    yield f"shape     {_shape_line(mesh, quality)}"
    yield f"angles    {number(quality['min_angle'], 4)} to {number(quality['max_angle'], 4)} degrees"
    yield f"elements  {_elements_line(mesh, quality)}"
    yield f"faces     {intersections(quality)}"
    if deviation := report["deviation"]:
        yield (
            f"deviation mean {number(deviation['mean'])}, at most {number(deviation['max'])} in values,"
            f" {number(deviation['max_relative'])} of their range, {number(deviation['max_mm'])} mm"
        )
    if curvature := report["curvature"]:
        for name, key in (("curvature mean", "mean"), ("          Gaussian", "gaussian")):
            found = curvature[key]
            yield (
                f"{name}: {number(found['mean'], 3)} over the area, {number(found['min'], 3)} to"
                f" {number(found['max'], 3)}, of nine in ten vertices {number(found['percentile_5'], 3)} to"
                f" {number(found['percentile_95'], 3)}"
            )
    yield from thickness_lines(report)
    if distance := report["distance"]:
        for name, key in (("distance  to the other mesh", "to_other"), ("          from it", "from_other")):
            way = distance[key]
            yield (
                f"{name}: mean {number(way['mean'], 3)}, 95 % within {number(way['percentile_95'], 3)},"
                f" at most {number(way['max'], 3)} {distance['unit']} ({way['samples']} samples)"
            )
    yield from requirement_lines(report)


def _shape_line(mesh: dict[str, Any], quality: dict[str, Any]) -> str:
    """Tell the papers' two measures of shape and the scaled Jacobian, those of quads where there are any."""
    mean_ratio = f"mean ratio {number(quality['mean_ratio_mean'], 4)}"
    if not mesh["quads"]:
        jacobian = number(quality["triangle_scaled_jacobian_min"])
        return f"{mean_ratio}; scaled Jacobian of triangles at least {jacobian}"
    mean, least = number(quality["shape_mean"], 4), number(quality["shape_min"])
    jacobian = number(quality["scaled_jacobian_min"])
    return f"mean {mean}, least {least}; {mean_ratio}; scaled Jacobian at least {jacobian}"


def _elements_line(mesh: dict[str, Any], quality: dict[str, Any]) -> str:
    """Tell the measures of finite elements, those of quads where there are any."""
    parts = []
    if mesh["quads"]:
        parts += [f"{name} at most {number(quality[f'{key}_max'], 3)}" for name, key in _WORST]
        parts.append(f"stretch at least {number(quality['stretch_min'])}")
    mean, least = number(quality["radius_ratio_mean"], 4), number(quality["radius_ratio_min"])
    return ", ".join([*parts, f"radius ratio of triangles mean {mean}, least {least}"])
