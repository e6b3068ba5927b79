"""Compute the share of irregular vertices: those with other than four mesh edges."""

import warp as wp

from dmc_cli.mesh.mesh import Mesh

wp.set_module_options({"enable_backward": False})

REGULAR = wp.constant(4)
"""Valence of a regular vertex of a quad mesh."""

BLOCK = wp.constant(256)
"""Vertices that one thread counts."""


def irregular_percent(mesh: Mesh) -> float:
    """Return the share in percent of vertices of a connected mesh whose valence is not 4; 0 without any."""
    device, count, halfedges = mesh.device, mesh.vertex_count, mesh.halfedges
    if halfedges is None or not count:
        return 0.0
    blocks = -(-count // int(BLOCK))
    counts = device.empty(blocks, wp.int64)
    device.launch(count_irregular_kernel, blocks, [halfedges.valence], [counts])
    return 100.0 * device.starts(counts)[1] / count


@wp.kernel
def count_irregular_kernel(
    # In:
    first: wp.int32,
    valence: wp.array(dtype=wp.int32),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the irregular vertices. One thread a block of vertices."""
    block = first + wp.tid()
    count = wp.int32(0)
    for v in range(block * BLOCK, wp.min((block + 1) * BLOCK, valence.shape[0])):
        if valence[v] != REGULAR:
            count += 1
    counts_out[block] = wp.int64(count)
