"""Inspect the faces round each vertex: valence, one ring or one fan, non-manifold edges.

A walk through twins from one of a vertex's corners reaches exactly the faces of one ring or fan. It has
seen every face of nearly all vertices, and then tells everything about them. The rest, vertices with
several fans and the apex of a very large one, are listed and sorted out by vertex pairs.

Valence is the number of distinct mesh edges by vertex pair. An edge is non-manifold if more than two faces
have it; it is counted at its lower vertex.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray, ByteArray, Int32Array, IntArray
from dmc_cli.mesh import Mesh, connect, next_halfedge, next_outgoing_of_any, previous_halfedge

wp.set_module_options({"enable_backward": False})

ON_BOUNDARY = wp.constant(wp.uint32(0x80000000))
"""Added to the corner that a walk starts from, if it starts at a boundary: such corners win the maximum."""

LARGEST_WALK = wp.constant(64)
"""Faces round a vertex up to which its edges are compared pair by pair; the time grows with the square."""

FEW_EDGES = wp.constant(8)
"""Edges that fit into the registers in which they are compared at once; hardly a vertex has more."""

Ends = wp.types.vector(length=8, dtype=wp.int32)

SORTED_AT_ONCE, MOST_PASSES = 1 << 13, 64
"""Vertices whose edges are sorted at a time, at least: keys take more than faces. How often all faces are
gone through, at most."""

UNLISTED = -1
"""Valence of a vertex that the walk leaves to the sorting."""


@wp.kernel
def scatter_corners_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    twins: wp.array[wp.int32],
    # In/out:
    degrees_inout: wp.array[wp.int32],
    starts_inout: wp.array[wp.uint32],
) -> None:
    """Count each vertex's corners and choose one to start from. One thread a corner.

    Sums and maxima of integers: the order of the threads does not show. Not to be cut into chunks, since
    atomics on CPU are none.
    """
    h = first + wp.tid()
    vertex = corners[h]
    if vertex >= 0:
        start = wp.uint32(h)
        if twins[h] < 0:
            start += ON_BOUNDARY
        wp.atomic_add(degrees_inout, vertex, 1)
        wp.atomic_max(starts_inout, vertex, start)


@wp.func
def count_fan(corners: wp.array[wp.int32], twins: wp.array[wp.int32], start: wp.int32) -> wp.int32:
    """Return the number of faces in the ring or fan that `start` begins."""
    count = int(1)
    h = next_outgoing_of_any(corners, twins, start)
    while h >= 0 and h != start:
        count += 1
        h = next_outgoing_of_any(corners, twins, h)
    return count


@wp.func
def edge_end(
    corners: wp.array[wp.int32], twins: wp.array[wp.int32], h: wp.int32, is_last: wp.bool
) -> wp.int32:
    """Return the far vertex of the edge `h`, or of the last edge of the fan that `h` is the last face of."""
    end = previous_halfedge(corners, h)
    if not is_last:
        end = next_halfedge(corners, h)
    return corners[end]


@wp.func
def has_distinct_ends(
    corners: wp.array[wp.int32],
    twins: wp.array[wp.int32],
    vertex: wp.int32,
    start: wp.int32,
    count: wp.int32,
    edges: wp.int32,
) -> wp.bool:
    """Return whether a fan's few edges lead to as many vertices: no pair of them is the same edge."""
    ends = Ends()
    h = start
    distinct = bool(True)
    for e in range(edges):
        ends[e] = edge_end(corners, twins, h, e == count)
        if ends[e] == vertex:
            distinct = False
        for f in range(e):
            if ends[f] == ends[e]:
                distinct = False
        if e + 1 < count:
            h = next_outgoing_of_any(corners, twins, h)
    return distinct


@wp.func
def inspect_fan(
    corners: wp.array[wp.int32],
    twins: wp.array[wp.int32],
    vertex: wp.int32,
    start: wp.int32,
    count: wp.int32,
    is_open: wp.bool,
) -> wp.vec2i:
    """Return the valence and the number of non-manifold edges to higher vertices.

    Edges are numbered as the walk meets them; an open fan of `count` faces has one more edge, its last.
    The first edge of each group with the same far vertex stands for the group.
    """
    edges = count
    if is_open:
        edges = count + 1
    if edges <= FEW_EDGES:
        if has_distinct_ends(corners, twins, vertex, start, count, edges):
            return wp.vec2i(edges, 0)
    valence = int(0)
    nonmanifold = int(0)
    h = start
    for e in range(edges):
        end = edge_end(corners, twins, h, e == count)
        faces = int(2)
        if is_open and (e == 0 or e == count):
            faces = int(1)
        is_first = bool(end != vertex)
        g = start
        for f in range(edges):
            if f != e and edge_end(corners, twins, g, f == count) == end:
                if f < e:
                    is_first = False
                if is_open and (f == 0 or f == count):
                    faces += 1
                else:
                    faces += 2
            if f + 1 < count:
                g = next_outgoing_of_any(corners, twins, g)
        if is_first:
            valence += 1
            if faces > 2 and end > vertex:
                nonmanifold += 1
        if e + 1 < count:
            h = next_outgoing_of_any(corners, twins, h)
    return wp.vec2i(valence, nonmanifold)


@wp.kernel
def inspect_vertices_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    twins: wp.array[wp.int32],
    degrees: wp.array[wp.int32],
    starts: wp.array[wp.uint32],
    # Out:
    valences_out: wp.array[wp.int32],
    nonmanifold_out: wp.array[wp.uint8],
    split_out: wp.array[wp.uint8],
) -> None:
    """Inspect the ring or fan that the walk reaches, if that is all there is. One thread a vertex."""
    vertex = first + wp.tid()
    degree = degrees[vertex]
    valence = int(0)
    nonmanifold = int(0)
    split = int(0)
    if degree > 0:
        is_open = starts[vertex] >= ON_BOUNDARY
        start = wp.int32(starts[vertex] & ~ON_BOUNDARY)
        count = count_fan(corners, twins, start)
        if count != degree:
            split = 1
        valence = -1
        if count == degree and count <= LARGEST_WALK:
            found = inspect_fan(corners, twins, vertex, start, count, is_open)
            valence = found[0]
            nonmanifold = found[1]
    valences_out[vertex] = valence
    nonmanifold_out[vertex] = wp.uint8(nonmanifold)
    split_out[vertex] = wp.uint8(split)


@dataclass(frozen=True)
class VertexFans:
    """What surrounds the vertices.

    Attributes:
        valences: Distinct mesh edges of each vertex, (V,) int32; 0 if no face uses it.
        nonmanifold_edges: Vertex pairs that more than two faces have.
        split_vertices: Vertices whose faces form more than one ring or fan.
        splits: Which these are: 1, others 0, (V,) uint8.
        misoriented_edges: Vertex pairs whose only two faces run them the same way.
        corner_count: Corners of all faces together.
    """

    valences: Int32Array
    nonmanifold_edges: int
    split_vertices: int
    splits: ByteArray
    misoriented_edges: int
    corner_count: int


def inspect_vertices(mesh: Mesh) -> VertexFans:
    """Walk round every vertex of a mesh."""
    halfedges = connect(mesh).require_halfedges()
    device, vertex_count = mesh.device, mesh.vertex_count
    corners, twins = mesh.corners, halfedges.twin
    degrees = device.zeros(vertex_count, wp.int32)
    starts = device.zeros(vertex_count, wp.uint32)
    device.launch_whole(scatter_corners_kernel, corners.shape[0], [corners, twins], [degrees, starts])
    valences = device.empty(vertex_count, wp.int32)
    nonmanifold = device.empty(vertex_count, wp.uint8)
    split = device.empty(vertex_count, wp.uint8)
    device.launch(
        inspect_vertices_kernel,
        vertex_count,
        inputs=[corners, twins, degrees, starts],
        outputs=[valences, nonmanifold, split],
    )
    host_valences = valences.numpy()
    nonmanifold_edges = int(nonmanifold.numpy().sum(dtype=np.int64))
    misoriented = 0
    listed = np.flatnonzero(host_valences == UNLISTED)
    if len(listed):
        host_valences = host_valences.copy()
        found, more_nonmanifold, misoriented = _sort_out(corners.numpy().reshape(-1, 4), listed, vertex_count)
        host_valences[listed] = found
        nonmanifold_edges += more_nonmanifold
    return VertexFans(
        valences=host_valences,
        nonmanifold_edges=nonmanifold_edges,
        split_vertices=int(split.numpy().sum(dtype=np.int64)),
        splits=split.numpy(),
        misoriented_edges=misoriented,
        corner_count=device.total(degrees),
    )


def _sort_out(faces: Int32Array, listed: IntArray, count: int) -> tuple[Int32Array, int, int]:
    """Return the valences of listed ones of `count` vertices, their non-manifold and misoriented edges.

    Edges are those to higher vertices.
    """
    step = max(SORTED_AT_ONCE, -(-len(listed) // MOST_PASSES))
    wanted = np.zeros(count, bool)
    valences, nonmanifold, misoriented = np.zeros(len(listed), np.int32), 0, 0
    for start in range(0, len(listed), step):
        part = listed[start : start + step]
        wanted[part] = True
        found = _sort_edges(faces, part, wanted)
        wanted[part] = False
        valences[start : start + step] = found[0]
        nonmanifold, misoriented = nonmanifold + found[1], misoriented + found[2]
    return valences, nonmanifold, misoriented


def _sort_edges(faces: Int32Array, part: IntArray, wanted: BoolArray) -> tuple[IntArray, int, int]:
    """Do what `_sort_out` does for some vertices; `wanted` marks them."""
    vertex_count = len(wanted)
    tails = faces[wanted[faces].any(axis=1)]
    heads = np.roll(tails, -1, axis=1)
    is_triangle = tails[:, 3] < 0
    heads[is_triangle, 2] = tails[is_triangle, 0]
    is_edge = (tails >= 0) & (tails != heads)
    keys = np.concatenate(
        [
            2 * (near[mine].astype(np.int64) * vertex_count + far[mine]) + leaves
            for near, far, leaves in ((tails, heads, 1), (heads, tails, 0))
            for mine in [is_edge & wanted[near]]
        ]
    )
    keys.sort()
    pairs = keys >> 1
    firsts = np.flatnonzero(np.diff(pairs, prepend=-1))
    counts = np.diff(firsts, append=len(keys))
    leaving = np.add.reduceat(keys & 1, firsts)
    owner, other = np.divmod(pairs[firsts], vertex_count)
    is_owned = owner < other
    valences = np.bincount(np.searchsorted(part, owner), minlength=len(part))
    nonmanifold = int(np.count_nonzero(is_owned & (counts > 2)))
    misoriented = int(np.count_nonzero(is_owned & (counts == 2) & (leaving != 1)))
    return valences, nonmanifold, misoriented
