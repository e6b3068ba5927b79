"""Measure how far the rounding of its coordinates moves each vertex of a surface (`rounding.py`)."""

import numpy as np
import warp as wp

from dmc_cli.field import Grid, cell_node, depth_position, kernel_matrix, slice_distance
from dmc_cli.measures.rounding import Rounding
from dmc_cli.mesh import Mesh, Placement
from dmc_cli.volume import Volume

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

BLOCK = wp.constant(256)
"""Vertices that one thread looks at."""


def measure_rounding(mesh: Mesh, placement: Placement, volume: Volume) -> Rounding | None:
    """Measure how far the rounding of its coordinates moves a mesh's vertices; None without vertices."""
    count, device, frame = mesh.vertex_count, mesh.device, placement.frame
    if not count:
        return None
    blocks = -(-count // int(BLOCK))
    peaks = device.empty((blocks, 2), wp.float64)
    to_grid = np.linalg.inv(frame.affine[:3, :3])
    inputs = [
        frame.grid.struct(),
        kernel_matrix(frame.affine),
        wp.mat33d(*to_grid.ravel()),
        wp.mat33d(*(volume.affine[:3, :3] @ to_grid).ravel()),
        frame.depths,
        placement.cell,
        placement.local,
        mesh.positions,
    ]
    device.launch(measure_rounding_kernel, blocks, inputs, [peaks])
    mm, relative = peaks.numpy().max(axis=0).tolist()
    return Rounding(mm=mm, relative=relative)


@wp.kernel
def measure_rounding_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    affine: wp.mat44d,
    to_grid: wp.mat33d,
    to_mm: wp.mat33d,
    depths: wp.array(dtype=wp.float64),
    cells: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    positions: wp.array(dtype=wp.vec3),
    # Out:
    peaks_out: wp.array2d(dtype=wp.float64),
) -> None:
    """Find the largest rounding in a block of vertices. One thread a block.

    `to_grid` and `to_mm` turn a way in the output space into one in cells and one in millimetres. The origin
    is taken away first, which leaves exact what is left. So this cannot be `world_position`, which adds the
    origin and rounds.
    """
    block = first + wp.tid()
    peaks = wp.vec2d()
    for v in range(block * BLOCK, wp.min((block + 1) * BLOCK, cells.shape[0])):
        node = cell_node(grid, cells[v])
        x = depth_position(depths, node, local[v])
        way = wp.vec3d()
        for axis in range(3):
            written = wp.float64(positions[v][axis]) - affine[axis, 3]
            way[axis] = written - (affine[axis, 0] * x[0] + affine[axis, 1] * x[1] + affine[axis, 2] * x[2])
        in_cells = to_grid * way
        in_cells[2] = in_cells[2] / slice_distance(depths, node[2])
        peaks[0] = wp.max(peaks[0], wp.length(to_mm * way))
        peaks[1] = wp.max(peaks[1], wp.max(wp.abs(in_cells)))
    peaks_out[block, 0] = peaks[0]
    peaks_out[block, 1] = peaks[1]
