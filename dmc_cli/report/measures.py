"""All measures of a surface in one call: topology, quality, deviation."""

from typing import Any

from dmc_cli.report.deviation import measure_deviation
from dmc_cli.report.quality import measure_quality
from dmc_cli.report.report import Measures
from dmc_cli.report.topology import measure_topology
from dmc_cli.surface import Surface
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
        deviation=measure_deviation(
            device,
            volume,
            volume.value_range(),
            surface.field,
            surface.grid,
            surface.vertex_cell,
            surface.vertex_local,
        ),
    )
