"""Colour the vertices of any mesh with 8 colours (Grosso & Zint 2021, section 3.1.4).

A vertex has its cell's colour, the parity of the cell's indices: (i & 1) | (j & 1) << 1 | (k & 1) << 2.
With a closed border the indices are those of the padded grid.
"""

from typing import Any

import warp as wp

from dmc_cli.field import Grid, cell_node
from dmc_cli.mesh import Placement

wp.set_module_options({"enable_backward": False})


def color_vertices(placement: Placement) -> Any:
    """Return the colour of each vertex's cell, 0 to 7, uint8 (V,)."""
    device, count = placement.frame.device, placement.cell.shape[0]
    colors = device.empty(count, wp.uint8)
    device.launch(color_vertices_kernel, count, [placement.frame.grid.struct(), placement.cell], [colors])
    return colors


@wp.kernel
def color_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    cells: wp.array(dtype=wp.int64),
    # Out:
    colors_out: wp.array(dtype=wp.uint8),
) -> None:
    """Colour the vertices by the parity of their cell's indices. One thread per vertex."""
    v = first + wp.tid()
    node = cell_node(grid, cells[v])
    colors_out[v] = wp.uint8((node[0] & 1) | ((node[1] & 1) << 1) | ((node[2] & 1) << 2))
