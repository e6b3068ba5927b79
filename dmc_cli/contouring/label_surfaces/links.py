"""List the neighbours and the quads of each vertex of a label net, and tell which vertices lie on junctions.

A vertex is *regular* if its quads separate the same two labels. Others are *junctions*; one with two
neighbours along the curve where three labels or more meet lies on that curve, and any other one ends curves
and stays.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import bit_index, has_bit
from dmc_cli.contouring.label_surfaces.cell_loops import Codes, corner_codes
from dmc_cli.contouring.label_surfaces.crossings import CrossingWords, active_index, quad_index
from dmc_cli.contouring.label_surfaces.net import LabelNet, along
from dmc_cli.contouring.stages.tracing import (
    EDGE_HIGH,
    EDGE_LOW,
    FACE_EDGE_BITS,
    FACE_EDGES,
    edges_owned,
    owner_of,
)
from dmc_cli.field import Grid, cell_node
from dmc_cli.runtime import FLAGS_A_CHUNK, ITEMS_A_CHUNK, Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

REGULAR, ON_CURVE, FIXED = wp.constant(0), wp.constant(1), wp.constant(2)
"""Kinds of vertices: between two labels; on a curve where more meet; where curves end, or otherwise kept."""


@wp.struct
class Links:
    """Neighbours, quads and kinds of the vertices of a net."""

    neighbour_start: wp.array(dtype=wp.int32)
    neighbours: wp.array(dtype=wp.int32)  # of a vertex on a curve those along it first
    shift: wp.array(dtype=wp.vec3)  # the mean way from a vertex's cell to those that it averages with
    quad_start: wp.array(dtype=wp.int32)
    quads: wp.array(dtype=wp.int32)
    kind: wp.array(dtype=wp.uint8)


@dataclass(frozen=True)
class NetLinks:
    """What the vertices are linked to, and where they begin.

    Attributes:
        links: The kernels' `Links`.
        start: The mean of the middles of each vertex's crossed edges, in its cell, float32 vec3 (V,).
        cells: Its cell by the lowest node, int64 (V,).
    """

    links: Any
    start: Any
    cells: Any


def link_vertices(net: LabelNet) -> NetLinks:
    """List what each vertex of a net is linked to."""
    device, count = net.device, net.vertex_count
    cells = int(net.cells.shape[0])
    links = Links()
    kind, start = device.empty(count, wp.uint8), device.empty(count, wp.vec3)
    vertex_cell = device.empty(count, wp.int64)
    neighbours, quads = device.empty(count, wp.int64), device.empty(count, wp.int64)
    inputs = [net.grid.struct(), net.words, net.codes, net.cells, net.owners, net.vertex_start]
    outputs = [vertex_cell, start, kind, neighbours, quads]
    device.launch(count_links_kernel, cells, inputs, outputs, ITEMS_A_CHUNK)
    links.kind = kind
    links.shift = device.empty(count, wp.vec3)
    long_starts, total = device.starts(neighbours)
    links.neighbour_start = _shortened(long_starts, device)
    long_starts, quad_total = device.starts(quads)
    links.quad_start = _shortened(long_starts, device)
    links.neighbours = device.empty(total, wp.int32)
    links.quads = device.empty(quad_total, wp.int32)
    device.launch(emit_links_kernel, cells, inputs, [links], ITEMS_A_CHUNK)
    return NetLinks(links, start, vertex_cell)


def _shortened(starts: Any, device: Device) -> Any:
    """Return numbers of 64 bits, all of which fit, as ones of 32."""
    short = device.empty(starts.shape[0], wp.int32)
    device.launch(shorten_kernel, starts.shape[0], [starts], [short], FLAGS_A_CHUNK)
    return short


@wp.kernel
def shorten_kernel(
    # In:
    first: wp.int32,
    numbers: wp.array(dtype=wp.int64),
    # Out:
    numbers_out: wp.array(dtype=wp.int32),
) -> None:
    """Copy a number of 64 bits to one of 32. One thread per number."""
    n = first + wp.tid()
    numbers_out[n] = wp.int32(numbers[n])


@wp.func
def beyond(node: wp.vec3i, face: wp.int32) -> wp.vec3i:
    """Return the cell on the other side of a face."""
    return along(node, face / 2, 2 * (face & 1) - 1)


@wp.func
def owners_beyond(edges: wp.uint32, face: wp.int32, owners: wp.uint64) -> wp.uint32:
    """Return a bit for each cluster of the cell beyond a face that has one of some edges of the face."""
    found = wp.uint32(0)
    for side in range(4):
        if has_bit(edges, FACE_EDGES[4 * face + side]):
            found |= wp.uint32(1) << wp.uint32(owner_of(owners, FACE_EDGES[4 * (face ^ 1) + side]))
    return found


@wp.func
def separates_several(c: Codes, edges: wp.uint32) -> wp.bool:
    """Return whether some crossed edges lie between more than two labels."""
    several = bool(False)
    left = edges
    lead = bit_index(edges)
    a = c[EDGE_LOW[lead]]
    b = c[EDGE_HIGH[lead]]
    while left != wp.uint32(0):
        edge = bit_index(left)
        left &= left - wp.uint32(1)
        p = c[EDGE_LOW[edge]]
        q = c[EDGE_HIGH[edge]]
        if not ((p == a and q == b) or (p == b and q == a)):
            several = True
    return several


@wp.func
def edge_middle(edge: wp.int32) -> wp.vec3:
    """Return the middle of an edge in local coordinates."""
    a = EDGE_LOW[edge]
    b = EDGE_HIGH[edge]
    return wp.vec3(
        0.5 * float((a & 1) + (b & 1)),
        0.5 * float(((a >> 1) & 1) + ((b >> 1) & 1)),
        0.5 * float((a >> 2) + (b >> 2)),
    )


@wp.kernel
def count_links_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: CrossingWords,
    codes: wp.array3d(dtype=wp.uint16),
    cells: wp.array(dtype=wp.int64),
    owners: wp.array(dtype=wp.uint64),
    starts: wp.array(dtype=wp.int64),
    # Out:
    cell_out: wp.array(dtype=wp.int64),
    start_out: wp.array(dtype=wp.vec3),
    kind_out: wp.array(dtype=wp.uint8),
    neighbours_out: wp.array(dtype=wp.int64),
    quads_out: wp.array(dtype=wp.int64),
) -> None:
    """Place the vertices of a cell, count their links and tell their kinds. One thread per active cell."""
    n = first + wp.tid()
    node = cell_node(grid, cells[n])
    c = corner_codes(codes, node)
    for owner in range(wp.int32(starts[n + 1] - starts[n])):
        v = wp.int32(starts[n]) + owner
        edges = edges_owned(owners[n], owner)
        middle = wp.vec3()
        left = edges
        while left != wp.uint32(0):
            middle += edge_middle(bit_index(left))
            left &= left - wp.uint32(1)
        count = int(0)
        along_curve = int(0)
        for face in range(6):
            own = edges & wp.uint32(FACE_EDGE_BITS[face])
            if own != wp.uint32(0):
                m = active_index(words, grid, beyond(node, face))
                count += wp.int32(wp.bit_count(owners_beyond(own, face, owners[m])))
                if separates_several(c, own):
                    along_curve += 1
        size = wp.int32(wp.bit_count(edges))
        kind = wp.where(along_curve == 2, ON_CURVE, FIXED)
        if not separates_several(c, edges):
            kind = REGULAR
        cell_out[v] = cells[n]
        start_out[v] = middle / float(size)
        kind_out[v] = wp.uint8(kind)
        neighbours_out[v] = wp.int64(count)
        quads_out[v] = wp.int64(size)


@wp.kernel
def emit_links_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: CrossingWords,
    codes: wp.array3d(dtype=wp.uint16),
    cells: wp.array(dtype=wp.int64),
    owners: wp.array(dtype=wp.uint64),
    starts: wp.array(dtype=wp.int64),
    # In/out:
    links: Links,
) -> None:
    """List the neighbours and quads of a cell's vertices. One thread per active cell.

    The neighbours of a vertex on a curve that lie along it come first.
    """
    n = first + wp.tid()
    node = cell_node(grid, cells[n])
    c = corner_codes(codes, node)
    for owner in range(wp.int32(starts[n + 1] - starts[n])):
        v = wp.int32(starts[n]) + owner
        edges = edges_owned(owners[n], owner)
        slot = links.neighbour_start[v]
        is_on_curve = wp.int32(links.kind[v]) == ON_CURVE
        way = wp.vec3()
        reached = int(0)
        for run in range(2):
            for face in range(6):
                own = edges & wp.uint32(FACE_EDGE_BITS[face])
                if own != wp.uint32(0) and separates_several(c, own) == (run == 0):
                    m = active_index(words, grid, beyond(node, face))
                    left = owners_beyond(own, face, owners[m])
                    while left != wp.uint32(0):
                        links.neighbours[slot] = wp.int32(starts[m]) + bit_index(left)
                        slot += 1
                        if run == 0 or not is_on_curve:
                            way += wp.vec3(along(wp.vec3i(), face / 2, 2 * (face & 1) - 1))
                            reached += 1
                        left &= left - wp.uint32(1)
        links.shift[v] = way / float(wp.max(reached, 1))
        slot = links.quad_start[v]
        left = edges
        while left != wp.uint32(0):
            edge = bit_index(left)
            left &= left - wp.uint32(1)
            low = EDGE_LOW[edge]
            at = node + wp.vec3i(low & 1, (low >> 1) & 1, low >> 2)
            axis = bit_index(wp.uint32(low ^ EDGE_HIGH[edge]))
            links.quads[slot] = quad_index(words, grid, at, axis)
            slot += 1
