"""List the faces that are decided otherwise so that the mesh is manifold."""

import numpy as np

from dmc_cli.array_types import IntArray
from dmc_cli.contouring.dual_marching_cubes.cells import find_cells
from dmc_cli.contouring.dual_marching_cubes.manifold_repair import FLIPPED
from dmc_cli.contouring.dual_marching_cubes.polygons import trace_polygons
from dmc_cli.contouring.stages.classification import find_inside
from dmc_cli.contouring.stages.outcome import field_of
from dmc_cli.field import DeviceVolume, grid_of
from dmc_cli.settings import SurfaceSettings


def list_flips(volume: DeviceVolume, settings: SurfaceSettings) -> IntArray:
    """Return the flipped faces, int64 (n, 4): the lowest node i j k of a cell, the axis of its high face.

    Indices are the volume's: -1 is the layer that a closed border adds. Faces come by axis, then in grid
    order.
    """
    device = volume.device
    grid = grid_of(volume.volume.shape, border=int(settings.border == "closed"))
    nodes = find_inside(volume, settings, grid)
    cells = find_cells(nodes, grid, device)
    field = field_of(volume, settings, nodes)
    _, tallies = trace_polygons(cells, field, grid, settings.topology == "manifold", device)
    noted = tallies.suspects.numpy()
    rows, i = (each.numpy().astype(np.int64) for each in (cells.special_row, cells.special_i))
    lowest = np.stack([i, rows % grid.ny, rows // grid.ny], axis=1) - grid.border
    chosen = [np.flatnonzero(noted & (int(FLIPPED) << axis)) for axis in range(3)]
    axes = np.repeat(np.arange(3), [len(each) for each in chosen])
    return np.column_stack([lowest[np.concatenate(chosen)], axes])
