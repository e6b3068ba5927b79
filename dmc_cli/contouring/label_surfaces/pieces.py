"""Find pieces of labels so small that their vertices are to stay at the centres of their cells.

With its vertices there the net is the boundary of the voxels, so that a piece keeps its volume exactly;
smoothing would take most of it. A piece is a set of nodes of one label that are joined along the axes.
"""

import warp as wp

from dmc_cli.bits import bit_index
from dmc_cli.contouring.label_surfaces.crossings import CrossingWords
from dmc_cli.contouring.label_surfaces.links import FIXED, Links, NetLinks
from dmc_cli.contouring.label_surfaces.net import LabelNet, along
from dmc_cli.field import Grid, row_place

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

MOST_NODES = 8
"""Nodes of the largest piece that stays as it is."""

Nodes = wp.types.matrix(shape=(MOST_NODES, 3), dtype=wp.int32)
"""Nodes that are known to belong to a piece."""


def hold_pieces(net: LabelNet, links: NetLinks) -> None:
    """Put the vertices of small pieces at the centres of their cells, for good."""
    device = net.device
    small = device.empty(net.quad_count, wp.uint8)
    inputs = [net.grid.struct(), net.words, net.codes, net.frames]
    device.launch(find_pieces_kernel, net.grid.layer * net.grid.nz, inputs, [small])
    device.launch(hold_kernel, net.vertex_count, [links.links, small], [links.start])


@wp.func
def is_small(grid: Grid, codes: wp.array3d(dtype=wp.uint16), node: wp.vec3i) -> wp.bool:
    """Return whether the piece that a node belongs to is small; what reaches the outermost nodes is not."""
    code = codes[node[2], node[1], node[0]]
    nodes = Nodes()
    nodes[0] = node
    count = int(1)
    at = int(0)
    while at < count:
        for way in range(6):
            p = along(nodes[at], way / 2, 2 * (way & 1) - 1)
            if wp.min(p) < 0 or p[0] >= grid.nx or p[1] >= grid.ny or p[2] >= grid.nz:
                return False
            if codes[p[2], p[1], p[0]] == code:
                is_new = bool(True)
                for known in range(count):
                    if nodes[known] == p:
                        is_new = False
                if is_new:
                    if count == MOST_NODES:
                        return False
                    nodes[count] = p
                    count += 1
        at += 1
    return True


@wp.kernel
def find_pieces_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: CrossingWords,
    codes: wp.array3d(dtype=wp.uint16),
    frames: wp.array(dtype=wp.uint8),
    # Out:
    small_out: wp.array(dtype=wp.uint8),
) -> None:
    """Tell which quads lie between a small piece and something else. One thread per word of nodes."""
    n = first + wp.tid()
    row = n / grid.words
    place = row_place(grid, row)
    start = 32 * (n - row * grid.words)
    left = wp.vec3ui(words.x[n], words.y[n], words.z[n])
    for q in range(wp.int32(words.quad_start[n]), wp.int32(words.quad_start[n + 1])):
        axis = wp.int32(frames[q]) & 3
        node = wp.vec3i(start + bit_index(left[axis]), place[0], place[1])
        left[axis] = left[axis] & (left[axis] - wp.uint32(1))
        small = is_small(grid, codes, node) or is_small(grid, codes, along(node, axis, 1))
        small_out[q] = wp.where(small, wp.uint8(1), wp.uint8(0))


@wp.kernel
def hold_kernel(
    # In:
    first: wp.int32,
    links: Links,
    small: wp.array(dtype=wp.uint8),
    # In/out:
    start_inout: wp.array(dtype=wp.vec3),
) -> None:
    """Hold a vertex of a small piece at the centre of its cell. One thread per vertex."""
    v = first + wp.tid()
    held = bool(False)
    for slot in range(links.quad_start[v], links.quad_start[v + 1]):
        if small[links.quads[slot]] != wp.uint8(0):
            held = True
    if held:
        links.kind[v] = wp.uint8(FIXED)
        start_inout[v] = wp.vec3(0.5, 0.5, 0.5)
