"""Take all measures of a surface in one call: topology, quality, deviation."""

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.measures.deviation import Deviation, measure_deviation
from dmc_cli.measures.locate import locate
from dmc_cli.measures.measure_rounding import measure_rounding
from dmc_cli.measures.quality import measure_quality
from dmc_cli.measures.topology import measure_topology
from dmc_cli.mesh.near_frame import COARSE
from dmc_cli.mesh.surface import Surface
from dmc_cli.report.report import Measures
from dmc_cli.volume.volume import Volume


def measure_surface(surface: Surface, twin: Any, volume: Volume) -> Measures:
    """Measure the mesh of a surface against itself and against the volume that it comes from.

    Args:
        surface: The mesh, with its vertices' cells.
        twin: Twin of each halfedge, int32 (4Q,), as the grid has them.
        volume: The volume.
    """
    device = surface.device
    return Measures(
        topology=measure_topology(device, surface.quads, twin, surface.vertices.shape[0]),
        quality=measure_quality(device, surface.vertices, surface.quads),
        deviation=_deviation(surface, volume),
    )


def _deviation(surface: Surface, volume: Volume) -> Deviation:
    """Measure the deviation, of the positions as they are written where their rounding counts."""
    device, places = surface.device, (surface.vertex_cell, surface.vertex_local)
    rounding = measure_rounding(surface, volume)
    if rounding is not None and rounding.relative > COARSE:
        points = surface.vertices.numpy().astype(np.float64)
        cells, local, _ = locate(points, surface.affine, surface.grid, surface.depths.numpy())
        places = (
            wp.array(cells, dtype=wp.int64, device=device.name),
            wp.array(local, dtype=wp.vec3f, device=device.name),
        )
    deviation = measure_deviation(device, volume, volume.value_range(), surface.field, surface.grid, *places)
    if rounding is None:
        return deviation
    return replace(deviation, rounding_mm=rounding.mm, rounding_relative=rounding.relative)
