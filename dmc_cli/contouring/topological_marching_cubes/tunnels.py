"""List the cells in which the trilinear surface has a tunnel, which no mesh of one vertex a polygon forms."""

import numpy as np

from dmc_cli.array_types import IntArray
from dmc_cli.contouring.stages.edge_surface import find_edges
from dmc_cli.contouring.topological_marching_cubes.extraction import tally_cells
from dmc_cli.contouring.topological_marching_cubes.trilinear_cells import TUNNELS
from dmc_cli.field import DeviceVolume
from dmc_cli.settings import SurfaceSettings


def list_tunnels(volume: DeviceVolume, settings: SurfaceSettings) -> IntArray:
    """Return the lowest nodes of cells with a tunnel, int64 (n, 3), i j k, in grid order.

    Indices are the volume's: -1 is the layer that a closed border adds.
    """
    stages = find_edges(volume, settings, None, False, serves_special=False)
    _, tallies = tally_cells(stages)
    chosen = np.flatnonzero(tallies.numpy()[TUNNELS])
    rows, i = (nodes.numpy()[chosen].astype(np.int64) for nodes in (stages.special.row, stages.special.i))
    nodes = np.stack([i, rows % stages.grid.ny, rows // stages.grid.ny], axis=1)
    return nodes - stages.grid.border
