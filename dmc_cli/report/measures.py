"""Take all measures of a surface in one call: topology, quality, deviation."""

from dataclasses import replace

import numpy as np

from dmc_cli.measures import (
    Deviation,
    count_intersections,
    list_components,
    locate_points,
    measure_curvature,
    measure_deviation,
    measure_elements,
    measure_quality,
    measure_rounding,
    measure_thickness,
    measure_topology,
)
from dmc_cli.mesh import COARSE, Mesh, Placement
from dmc_cli.report.report import Measures
from dmc_cli.volume import Volume


def measure_surface(
    mesh: Mesh,
    placement: Placement,
    volume: Volume,
    *,
    intersections: bool,
    known_intersections: int | None = None,
    curvature: bool = False,
    components: bool = False,
    thickness: bool = False,
    wall: float | None = None,
) -> Measures:
    """Measure a mesh against itself, with what is asked for besides, and against the volume it comes from.

    Intersections are not counted again where it is known how many there are.
    """
    crossings = known_intersections
    if intersections and crossings is None:
        crossings = count_intersections(mesh)
    return Measures(
        topology=measure_topology(mesh),
        quality=measure_quality(mesh),
        elements=measure_elements(mesh),
        self_intersections=crossings,
        deviation=_deviation(mesh, placement, volume),
        curvature=measure_curvature(mesh) if curvature else None,
        components=list_components(mesh) if components else None,
        thickness=measure_thickness(mesh, wall) if thickness else None,
    )


def _deviation(mesh: Mesh, placement: Placement, volume: Volume) -> Deviation:
    """Measure the deviation, of the positions as they are written where their rounding counts."""
    rounding = measure_rounding(mesh, placement, volume)
    if rounding is not None and rounding.relative > COARSE:
        placement, _ = locate_points(mesh.positions.numpy().astype(np.float64), placement.frame)
    deviation = measure_deviation(placement, volume, volume.value_range())
    if rounding is None:
        return deviation
    return replace(deviation, rounding_mm=rounding.mm, rounding_relative=rounding.relative)
