"""Hold what remeshing works on: a mesh in regions, and a bench for each region.

A *region* is a set of quads that one thread works on. A vertex is a region's own if all its quads are the
region's; only own vertices and their quads are read or changed, so regions never meet.

Every change of connectivity is journalled: `undo` takes back what was changed since `begin`, `redo` does it
again. So an operation is done first and judged afterwards, on the mesh as it would be.
"""

import warp as wp

from dmc_cli.mesh import MeshArrays, next_outgoing

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

CORNER, TWIN, START, VALENCE, FACE_GONE, VERTEX_GONE = range(6)
"""The arrays whose changes are journalled."""

JOURNAL = 640
"""Changes of one operation at most: about 40 of each rotation, as many of each vertex that is taken up."""

CORE = 40
"""Vertices that one operation may touch: 6, about four for each link of a chain, two for each doublet."""

PATCH = 144
"""Quads round these vertices at most: a multiple of the lanes of a vector."""

TRACKED = 320
"""Tracked points of these quads at most."""

LINKS = 12
"""Rotations that one operation may be followed by at most."""

JOURNALLED, TOUCHED, PATCHED, FAILED, SPARE_VERTEX, SPARE_QUAD = range(6)
KEPT, REMOVED, HAS_SPLIT, LINKED, CHANGES = range(6, 11)
WARPED_LEFT, EXCESS_LEFT, SEVERE_LEFT, TALLIES = range(11, 15)
"""What a region tallies: the vertices that a collapse keeps and removes, say; the last is their number."""

MOST_VALENCE = 8
"""Largest valence that an operation may leave."""

LONGEST_RING = 32
"""Quads round a vertex that are looked at: no vertex of a surface has so many."""


@wp.struct
class Work:
    """A mesh and the benches of its regions.

    Attributes:
        mesh: The mesh, with room for what is new.
        normal: (V,), the surface's unit normal at each vertex.
        vertex_region: (V,), the region that each vertex is the own of; -1 for none.
        first_point: (Q,), the first tracked point of each quad; -1 for none.
        tracked_point: (G,), each tracked point, in node indices.
        nearest_quad: (G,), the quad that it is assigned to.
        next_point: (G,), the next point of the same quad; -1 after the last.
        journal_place: (R, JOURNAL), which entry of which array each change was made to.
        journal_value: (R, JOURNAL), what stood there before, or after `undo` what stands there again.
        core: (R, CORE), the vertices that the operation touches.
        chain: (R, LINKS), the halfedges that the links of its chain rotate.
        core_valence: (R, CORE), the touched vertices' valences before.
        core_position: (R, CORE), their positions before.
        core_cell: (R, CORE), their cells before.
        core_local: (R, CORE), their local coordinates before.
        core_normal: (R, CORE), the normals there before.
        patch: (R, PATCH), the quads round the touched vertices.
        measured: (R, MEASURES, PATCH), what `measure_quads` has found of them.
        listed: (R, TRACKED), the tracked points of these quads.
        new_nearest: (R, TRACKED), the quads that they are to be assigned to.
        tally: (R, TALLIES), what the region tallies.
        sense: 1 if quads face along the gradient of F, else -1.
    """

    mesh: MeshArrays
    normal: wp.array(dtype=wp.vec3)
    vertex_region: wp.array(dtype=wp.int32)
    first_point: wp.array(dtype=wp.int32)
    tracked_point: wp.array(dtype=wp.vec3)
    nearest_quad: wp.array(dtype=wp.int32)
    next_point: wp.array(dtype=wp.int32)
    journal_place: wp.array2d(dtype=wp.int64)
    journal_value: wp.array2d(dtype=wp.int32)
    core: wp.array2d(dtype=wp.int32)
    chain: wp.array2d(dtype=wp.int32)
    core_valence: wp.array2d(dtype=wp.int32)
    core_position: wp.array2d(dtype=wp.vec3)
    core_cell: wp.array2d(dtype=wp.int64)
    core_local: wp.array2d(dtype=wp.vec3)
    core_normal: wp.array2d(dtype=wp.vec3)
    patch: wp.array2d(dtype=wp.int32)
    measured: wp.array3d(dtype=wp.float32)
    listed: wp.array2d(dtype=wp.int32)
    new_nearest: wp.array2d(dtype=wp.int32)
    tally: wp.array2d(dtype=wp.int32)
    sense: wp.float32


@wp.func
def begin(work: Work, b: wp.int32) -> None:
    """Start an operation."""
    work.tally[b, JOURNALLED] = 0
    work.tally[b, TOUCHED] = 0
    work.tally[b, PATCHED] = 0
    work.tally[b, FAILED] = 0
    work.tally[b, KEPT] = -1
    work.tally[b, REMOVED] = -1
    work.tally[b, HAS_SPLIT] = 0
    work.tally[b, LINKED] = 0


@wp.func
def fail(work: Work, b: wp.int32) -> None:
    """Give an operation up."""
    work.tally[b, FAILED] = 1


@wp.func
def clear_failure(work: Work, b: wp.int32) -> None:
    """Go on with an operation after what was tried has failed."""
    work.tally[b, FAILED] = 0


@wp.func
def has_failed(work: Work, b: wp.int32) -> wp.bool:
    """Return whether an operation was given up."""
    return work.tally[b, FAILED] != 0


@wp.func
def is_own(work: Work, b: wp.int32, v: wp.int32) -> wp.bool:
    """Return whether a vertex is the region's own: then its quads are, and may be read."""
    return work.vertex_region[v] == b


@wp.func
def touch(work: Work, b: wp.int32, v: wp.int32) -> None:
    """Note that an operation changes what is round a vertex; it fails if that is not the region's own."""
    count = work.tally[b, TOUCHED]
    known = bool(False)
    for n in range(count):
        if work.core[b, n] == v:
            known = bool(True)
    if not known:
        if not is_own(work, b, v) or count == CORE:
            fail(work, b)
        else:
            work.core[b, count] = v
            work.core_valence[b, count] = wp.where(
                work.mesh.vertex_gone[v] == wp.uint8(0), work.mesh.valence[v], 4
            )
            work.tally[b, TOUCHED] = count + 1


@wp.func
def exchange(work: Work, b: wp.int32, n: wp.int32) -> None:
    """Exchange an entry of the journal with what stands in its place."""
    place = work.journal_place[b, n]
    index = wp.int32(place >> wp.int64(3))
    kind = wp.int32(place & wp.int64(7))
    value = work.journal_value[b, n]
    old = int(0)
    if kind == CORNER:
        old = work.mesh.corners[index]
        work.mesh.corners[index] = value
    elif kind == TWIN:
        old = work.mesh.twin[index]
        work.mesh.twin[index] = value
    elif kind == START:
        old = work.mesh.vertex_halfedge[index]
        work.mesh.vertex_halfedge[index] = value
    elif kind == VALENCE:
        old = work.mesh.valence[index]
        work.mesh.valence[index] = value
    elif kind == FACE_GONE:
        old = wp.int32(work.mesh.face_gone[index])
        work.mesh.face_gone[index] = wp.uint8(value)
    else:
        old = wp.int32(work.mesh.vertex_gone[index])
        work.mesh.vertex_gone[index] = wp.uint8(value)
    work.journal_value[b, n] = old


@wp.func
def put(work: Work, b: wp.int32, kind: wp.int32, index: wp.int32, value: wp.int32) -> None:
    """Change a value and journal it; fail if the journal is full."""
    n = work.tally[b, JOURNALLED]
    if n == JOURNAL:
        fail(work, b)
    else:
        work.journal_place[b, n] = (wp.int64(index) << wp.int64(3)) | wp.int64(kind)
        work.journal_value[b, n] = value
        exchange(work, b, n)
        work.tally[b, JOURNALLED] = n + 1


@wp.func
def undo(work: Work, b: wp.int32) -> None:
    """Take back the changes since `begin`."""
    count = work.tally[b, JOURNALLED]
    for n in range(count):
        exchange(work, b, count - 1 - n)


@wp.func
def redo(work: Work, b: wp.int32) -> None:
    """Do again what was taken back."""
    for n in range(work.tally[b, JOURNALLED]):
        exchange(work, b, n)


@wp.func
def outgoing(work: Work, v: wp.int32, steps: wp.int32) -> wp.int32:
    """Return the outgoing halfedge of a vertex some steps after its first."""
    h = work.mesh.vertex_halfedge[v]
    for _step in range(steps):
        h = next_outgoing(work.mesh.twin, h)
    return h
