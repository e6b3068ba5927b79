"""Map vertices between unevenly spaced slices: vertices are mapped, not voxels.

The surface is found in index space, where slices do not know their distances. A volume whose slices are not
evenly spaced comes with the position of each; between two slices positions are linear. So a vertex at
k + w lies at depth(k) + w (depth(k + 1) - depth(k)), depths being in units of the affine's third column, and
a derivative along the third axis is divided by the local distance.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.field.grid import Grid, GridShape, cell_node, world_position
from dmc_cli.runtime import Device
from dmc_cli.volume import Volume

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def slice_depths(volume: Volume | None, grid: GridShape, device: Device) -> Any:
    """Return the depth of each slice of the grid, float64 (nz,), empty where slices are even.

    A virtual slice of a closed border has the distance of the two slices beside it. Without a volume slices
    are even.
    """
    if volume is None or volume.slice_positions is None:
        return device.empty(0, wp.float64)
    depths = np.asarray(volume.slice_positions, np.float64) / volume.spacing[2]
    if grid.border:
        before, after = 2 * depths[0] - depths[1], 2 * depths[-1] - depths[-2]
        depths = np.concatenate([[before], depths, [after]]) + grid.border
    return wp.array(depths, dtype=wp.float64, device=device.name)


def map_vertices(cell: Any, local: Any, depths: Any, grid: GridShape, matrix: Any, device: Device) -> Any:
    """Return the positions of vertices given by cell and local coordinates, float32 vec3 (V,).

    Args:
        cell: int64 (V,), linear number of the cell's lowest node in the grid.
        local: float32 vec3 (V,), coordinates in the cell.
        depths: As `slice_depths` returns them.
        grid: The grid over the volume.
        matrix: The kernels' map of the grid's node index, slices even, to the output space.
        device: Where the arrays are.
    """
    positions = device.empty(cell.shape[0], wp.vec3)
    inputs = [grid.struct(), matrix, depths, cell, local]
    device.launch(map_vertices_kernel, cell.shape[0], inputs, [positions])
    return positions


@wp.func
def depth_of(depths: wp.array(dtype=wp.float64), k: wp.int32, w: wp.float64) -> wp.float64:
    """Return the depth of a point of a cell in layer k."""
    depth = wp.float64(k) + w
    if depths.shape[0] > 0:
        depth = depths[k] + w * (depths[k + 1] - depths[k])
    return depth


@wp.func
def depth_position(depths: wp.array(dtype=wp.float64), node: wp.vec3i, local: wp.vec3) -> wp.vec3d:
    """Return the coordinates, in node indices as if slices were even, of a point of a cell."""
    return wp.vec3d(
        wp.float64(node[0]) + wp.float64(local[0]),
        wp.float64(node[1]) + wp.float64(local[1]),
        depth_of(depths, node[2], wp.float64(local[2])),
    )


@wp.func
def output_position(
    matrix: wp.mat44d, depths: wp.array(dtype=wp.float64), node: wp.vec3i, local: wp.vec3
) -> wp.vec3:
    """Return the position of a point of a cell in the output space."""
    return world_position(matrix, depth_position(depths, node, local))


@wp.func
def slice_distance(depths: wp.array(dtype=wp.float64), k: wp.int32) -> wp.float64:
    """Return the distance between slices k and k + 1, 1 where slices are even."""
    distance = wp.float64(1.0)
    if depths.shape[0] > 0:
        distance = depths[k + 1] - depths[k]
    return distance


@wp.func
def node_distance(depths: wp.array(dtype=wp.float64), k: wp.int32) -> wp.float64:
    """Return the distance that stands for one step of k at slice k: the mean of those on both sides."""
    distance = wp.float64(1.0)
    if depths.shape[0] > 0:
        low = wp.max(k - 1, 0)
        high = wp.min(k + 1, depths.shape[0] - 1)
        distance = (depths[high] - depths[low]) / wp.float64(high - low)
    return distance


@wp.kernel
def map_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    matrix: wp.mat44d,
    depths: wp.array(dtype=wp.float64),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
) -> None:
    """Map vertices to the output space. One thread a vertex."""
    v = first + wp.tid()
    position_out[v] = output_position(matrix, depths, cell_node(grid, cell[v]), local[v])
