"""Divide the mesh into regions for remeshing: boxes of the grid, shifted from round to round.

A quad belongs to the box that the cell of its first vertex lies in. A vertex is a region's own if all its
quads are the region's and it is not frozen; frozen for good are vertices whose quads do not form one ring.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.field import Grid, GridShape, cell_node
from dmc_cli.mesh import OWN_PREFIX, Mesh, WorkingMesh, next_outgoing, ring_size
from dmc_cli.processing.remeshing.work import LONGEST_RING
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SIDE = 32
"""Cells along a box's side: an operation needs some six quads; the more boxes, the more threads."""

SPARE_SHARE = 32
"""A region may split one vertex for so many of its own in a round, and one more."""

FROZEN = OWN_PREFIX + "frozen"
"""The value of the working mesh's vertices that tells which must stay: uint8, 1 for those."""


@dataclass(frozen=True)
class Regions:
    """The regions of one round, with their own vertices and spare places.

    Attributes:
        count: Regions.
        vertex_region: The region whose own a vertex is, int32 (V,), or -1.
        starts: Where each region's vertices start in `items`, int32 (count + 1,).
        items: The regions' own vertices, in ascending order in each, int32.
        spare_starts: The same for its spare places, int64 (count + 1,).
        spare: Spare places in all.
    """

    count: int
    vertex_region: Any
    starts: Any
    items: Any
    spare_starts: Any
    spare: int


def frozen_vertices(mesh: Mesh) -> Any:
    """Flag each vertex of a connected mesh on a boundary or with several fans, uint8 (V,)."""
    frozen, halfedges = mesh.device.empty(mesh.vertex_count, wp.uint8), mesh.require_halfedges()
    inputs = [halfedges.twin, halfedges.vertex_halfedge, halfedges.valence]
    mesh.device.launch(freeze_fans_kernel, mesh.vertex_count, inputs, [frozen])
    return frozen


def make_regions(mesh: WorkingMesh, grid: GridShape, number: int, side: int = SIDE) -> Regions:
    """Divide the mesh into the regions of a round or mending: its number, from 0, shifts the boxes.

    `side` is that of the boxes in cells: more than `SIDE` where quads are larger than cells.
    """
    device, arrays = mesh.device, mesh.arrays
    vertices, quads = mesh.vertex_count, mesh.face_count
    sizes = [n // side + 2 for n in (grid.nx, grid.ny, grid.nz)]
    shift = wp.vec3i(*(int(side * ((number * step) % 1.0)) for step in (0.8191725, 0.6710436, 0.5497005)))
    box, taken = device.empty(quads, wp.int32), device.zeros(sizes[0] * sizes[1] * sizes[2], wp.int64)
    inputs = [arrays.corners, arrays.cell, grid.struct(), side, shift, wp.vec3i(*sizes)]
    device.launch(find_boxes_kernel, quads, inputs, [box, taken])
    ranks, count = device.starts(taken)
    vertex_region = device.empty(vertices, wp.int32)
    keys, items = device.empty(2 * vertices, wp.int32), device.empty(2 * vertices, wp.int32)
    inputs = [arrays.twin, arrays.vertex_halfedge, arrays.valence, mesh.vertex_values[FROZEN]]
    inputs += [box, ranks, count]
    device.launch(own_vertices_kernel, vertices, inputs, [vertex_region, keys, items])
    if vertices:
        wp.utils.radix_sort_pairs(keys, items, vertices)
    starts, spares = device.zeros(count + 2, wp.int32), device.empty(count, wp.int64)
    device.launch(find_starts_kernel, vertices + 1, [keys, vertices, count], [starts])
    device.launch(count_spares_kernel, count, [starts], [spares])
    spare_starts, spare = device.starts(spares)
    return Regions(count, vertex_region, starts, items, spare_starts, spare)


def with_spares(regions: Regions, vertices: int, device: Device) -> Any:
    """Return the vertices' regions with those of the spare places at the end, int32."""
    longer = device.empty(vertices + regions.spare, wp.int32)
    if vertices:
        wp.copy(longer, regions.vertex_region, count=vertices)
    device.launch(own_spares_kernel, regions.count, [regions.spare_starts, vertices], [longer])
    return longer


@wp.kernel
def freeze_fans_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    vertex_halfedge: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    # Out:
    frozen_out: wp.array(dtype=wp.uint8),
) -> None:
    """Freeze the vertices whose quads do not form one ring. One thread a vertex."""
    v = first + wp.tid()
    size = ring_size(twin, vertex_halfedge[v], valence[v])
    frozen_out[v] = wp.where(size > 0 and size <= LONGEST_RING, wp.uint8(0), wp.uint8(1))


@wp.kernel
def find_boxes_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    grid: Grid,
    side: wp.int32,
    shift: wp.vec3i,
    sizes: wp.vec3i,
    # Out:
    box_out: wp.array(dtype=wp.int32),
    taken_out: wp.array(dtype=wp.int64),
) -> None:
    """Find the box of each quad and mark it as taken; a box gets the same from all. One thread a quad."""
    q = first + wp.tid()
    node = cell_node(grid, cell[corners[4 * q]]) + shift
    box = node[0] / side + sizes[0] * (node[1] / side + sizes[1] * (node[2] / side))
    box_out[q] = box
    taken_out[box] = wp.int64(1)


@wp.kernel
def own_vertices_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    vertex_halfedge: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    frozen: wp.array(dtype=wp.uint8),
    box: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int64),
    count: wp.int32,
    # Out:
    vertex_region_out: wp.array(dtype=wp.int32),
    keys_out: wp.array(dtype=wp.int32),
    items_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the region whose own a vertex is. One thread a vertex."""
    v = first + wp.tid()
    region = int(-1)
    if frozen[v] == wp.uint8(0):
        h = vertex_halfedge[v]
        common = box[h >> 2]
        region = wp.int32(ranks[common])
        for _n in range(valence[v]):
            if box[h >> 2] != common:
                region = int(-1)
            h = next_outgoing(twin, h)
    vertex_region_out[v] = region
    keys_out[v] = wp.where(region < 0, count, region)
    items_out[v] = v


@wp.kernel
def find_starts_kernel(
    # In:
    first: wp.int32,
    keys: wp.array(dtype=wp.int32),
    vertices: wp.int32,
    count: wp.int32,
    # Out:
    starts_out: wp.array(dtype=wp.int32),
) -> None:
    """Find where each key begins among the sorted ones. One thread a key, and one for the end."""
    n = first + wp.tid()
    before = int(-1)
    here = count + 1
    if n > 0:
        before = keys[n - 1]
    if n < vertices:
        here = keys[n]
    for key in range(before + 1, here + 1):
        starts_out[key] = n


@wp.kernel
def count_spares_kernel(
    # In:
    first: wp.int32,
    starts: wp.array(dtype=wp.int32),
    # Out:
    spares_out: wp.array(dtype=wp.int64),
) -> None:
    """Count a region's spare places. One thread a region."""
    b = first + wp.tid()
    size = starts[b + 1] - starts[b]
    spares_out[b] = wp.int64(wp.where(size > 0, size / SPARE_SHARE + 1, 0))


@wp.kernel
def own_spares_kernel(
    # In:
    first: wp.int32,
    spare_starts: wp.array(dtype=wp.int64),
    vertices: wp.int32,
    # Out:
    vertex_region_out: wp.array(dtype=wp.int32),
) -> None:
    """Give a region its spare places. One thread a region."""
    b = first + wp.tid()
    for n in range(wp.int32(spare_starts[b]), wp.int32(spare_starts[b + 1])):
        vertex_region_out[vertices + n] = b
