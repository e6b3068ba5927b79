r"""Remove quads with the valence pattern 3-3-3-3 (Grosso & Zint 2021, section 4.2).

    o3 --------- o2    All four vertices of the quad have valence 3. It takes the outer vertices o0 to o3,
    |  \       /  |    the four quads round it go, and so do its own vertices; nothing moves. The outer
    |   v3---v2   |    vertices lose one mesh edge each.
    |   | q  |    |
    |   v0---v1   |
    |  /       \  |
    o0 --------- o1

`paper`: not if an outer vertex has valence 3, nor if all four have 4 (a second quad would have the same
vertices); quads at a boundary or at a non-manifold edge, and their neighbours, are skipped. Two such quads
may share an outer vertex, which then is left with valence 2.

`safe`: moreover the quad's normal does not turn by 90 degrees, and of quads that share an outer vertex one
goes at a time.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import keep_flagged, order_key
from dmc_cli.mesh import MeshArrays, WorkingMesh, is_skipped, opposite_in_quad
from dmc_cli.runtime import FLAGS_A_CHUNK, ITEMS_A_CHUNK, Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

REMOVED_TOGETHER = 4
"""Quads that go with one pattern."""

LAST_KEY = wp.constant(wp.uint32(0xFFFFFFFF))
"""A key that comes after every other."""


def judge_3333(mesh: WorkingMesh, quads: Any, *, safe: bool) -> tuple[Any, Any]:
    """Return which of the quads may take the place of their neighbours, and which are refused, int64 flags.

    Args:
        mesh: The mesh.
        quads: Quads that have, or had, the pattern.
        safe: Refuse what the safe rules refuse beyond the papers'; else nothing is refused.
    """
    device, count = mesh.device, quads.shape[0]
    eligible, refused = device.empty(count, wp.int64), device.empty(count, wp.int64)
    device.launch(judge_3333_kernel, count, [mesh.arrays, quads, safe], [eligible, refused], ITEMS_A_CHUNK)
    return eligible, refused


def choose_unshared(mesh: WorkingMesh, quads: Any, eligible: Any) -> Any:
    """Return which of the eligible quads go at once, int64 flags: no two with a common outer vertex."""
    device, count = mesh.device, quads.shape[0]
    flags = device.empty(count, wp.int64)
    owner = device.empty(mesh.arrays.valence.shape[0], wp.uint32)
    device.launch(free_outer_kernel, count, [mesh.arrays, quads, eligible], [owner], FLAGS_A_CHUNK)
    device.launch_whole(claim_outer_kernel, count, [mesh.arrays, quads, eligible], [owner])
    device.launch(
        choose_unshared_kernel, count, [mesh.arrays, quads, eligible, owner], [flags], FLAGS_A_CHUNK
    )
    return flags


def remove_3333(mesh: WorkingMesh, quads: Any, flags: Any) -> None:
    """Stretch the flagged quads over their neighbours, which go."""
    device, count = mesh.device, quads.shape[0]
    sides, twins = device.empty(count, wp.vec4i), device.empty(count, wp.vec4i)
    device.launch(mark_3333_kernel, count, [mesh.arrays, quads, flags], [], FLAGS_A_CHUNK)
    device.launch(gather_sides_kernel, count, [mesh.arrays, quads, flags], [sides, twins], FLAGS_A_CHUNK)
    seams = device.empty(4 * count, wp.int32)
    device.launch(stretch_kernel, count, [mesh.arrays, quads, flags, sides, twins], [seams], FLAGS_A_CHUNK)
    device.launch_whole(lower_outer_kernel, count, [mesh.arrays, quads, flags], [])
    mesh.seams.append(seams)


def still_waiting(device: Device, quads: Any, eligible: Any, gone: Any) -> Any:
    """Return the quads that were eligible but did not go."""
    waiting = device.empty(quads.shape[0], wp.int64)
    device.launch(subtract_kernel, quads.shape[0], [eligible, gone], [waiting], FLAGS_A_CHUNK)
    return keep_flagged(device, quads, waiting)


@wp.func
def has_3333(mesh: MeshArrays, q: wp.int32) -> wp.bool:
    """Return whether all four vertices of a quad that is there have valence 3."""
    return (
        mesh.face_gone[q] == wp.uint8(0)
        and mesh.valence[mesh.corners[4 * q]] == 3
        and mesh.valence[mesh.corners[4 * q + 1]] == 3
        and mesh.valence[mesh.corners[4 * q + 2]] == 3
        and mesh.valence[mesh.corners[4 * q + 3]] == 3
    )


@wp.func
def outer_side(twin: wp.array(dtype=wp.int32), h: wp.int32) -> wp.int32:
    """Return the halfedge on the far side of the neighbour across h; it runs the same way as h."""
    return opposite_in_quad(twin[h])


@wp.func
def turns_over(
    corners: wp.array(dtype=wp.int32), position: wp.array(dtype=wp.vec3), q: wp.int32, o: wp.vec4i
) -> wp.bool:
    """Return whether a quad's normal turns by 90 degrees or more if it takes the outer vertices.

    They are four, and no quad has all of them: two at opposite corners that are one would leave the one
    between them with valence 2, or on a non-manifold edge; a quad with all four would have sides on
    non-manifold edges, or be what closes a mesh of six quads, where the outer vertices have valence 3.
    """
    before = wp.cross(
        position[corners[4 * q + 2]] - position[corners[4 * q]],
        position[corners[4 * q + 3]] - position[corners[4 * q + 1]],
    )
    after = wp.cross(position[o[2]] - position[o[0]], position[o[3]] - position[o[1]])
    return wp.dot(before, after) <= 0.0 and wp.length_sq(before) > 0.0


@wp.kernel
def judge_3333_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    safe: wp.bool,
    # Out:
    eligible_out: wp.array(dtype=wp.int64),
    refused_out: wp.array(dtype=wp.int64),
) -> None:
    """Judge the quads with the pattern. One thread per quad of the list."""
    n = first + wp.tid()
    q = quads[n]
    eligible = bool(False)
    refused = bool(False)
    if has_3333(mesh, q) and not is_skipped(mesh.twin, mesh.defect, q):
        o = wp.vec4i()
        some_three = bool(False)
        all_four = bool(True)
        for c in range(4):
            o[c] = mesh.corners[outer_side(mesh.twin, 4 * q + c)]
            some_three = some_three or mesh.valence[o[c]] <= 3
            all_four = all_four and mesh.valence[o[c]] == 4
        eligible = not some_three and not all_four
        if eligible and safe:
            refused = turns_over(mesh.corners, mesh.position, q, o)
            eligible = not refused
    eligible_out[n] = wp.int64(wp.where(eligible, 1, 0))
    refused_out[n] = wp.int64(wp.where(refused, 1, 0))


@wp.kernel
def free_outer_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    eligible: wp.array(dtype=wp.int64),
    # Out:
    owner_out: wp.array(dtype=wp.uint32),
) -> None:
    """Reset the owner of each outer vertex of the listed quads to none. One thread per quad of the list."""
    n = first + wp.tid()
    if eligible[n] == wp.int64(1):
        for c in range(4):
            owner_out[mesh.corners[outer_side(mesh.twin, 4 * quads[n] + c)]] = LAST_KEY


@wp.kernel
def claim_outer_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    eligible: wp.array(dtype=wp.int64),
    # In/out:
    owner_inout: wp.array(dtype=wp.uint32),
) -> None:
    """Claim the outer vertices: the lowest key has them. One thread per quad of the list; launched whole."""
    n = first + wp.tid()
    if eligible[n] == wp.int64(1):
        for c in range(4):
            o = mesh.corners[outer_side(mesh.twin, 4 * quads[n] + c)]
            wp.atomic_min(owner_inout, o, order_key(quads[n]))


@wp.kernel
def choose_unshared_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    eligible: wp.array(dtype=wp.int64),
    owner: wp.array(dtype=wp.uint32),
    # Out:
    flags_out: wp.array(dtype=wp.int64),
) -> None:
    """Choose the quads that have all their outer vertices. One thread per quad of the list."""
    n = first + wp.tid()
    goes = eligible[n] == wp.int64(1)
    if goes:
        for c in range(4):
            o = mesh.corners[outer_side(mesh.twin, 4 * quads[n] + c)]
            if owner[o] != order_key(quads[n]):
                goes = bool(False)
    flags_out[n] = wp.int64(wp.where(goes, 1, 0))


@wp.kernel
def mark_3333_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
) -> None:
    """Mark what goes: a flagged quad's neighbours and its own vertices. One thread per quad of the list."""
    n = first + wp.tid()
    if flags[n] == wp.int64(1):
        for c in range(4):
            h = 4 * quads[n] + c
            mesh.face_gone[mesh.twin[h] >> 2] = wp.uint8(1)
            mesh.vertex_gone[mesh.corners[h]] = wp.uint8(1)


@wp.kernel
def gather_sides_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
    # Out:
    sides_out: wp.array(dtype=wp.vec4i),
    twins_out: wp.array(dtype=wp.vec4i),
) -> None:
    """Store the outer sides and their twins, before anything changes. One thread per quad of the list.

    A quad beyond that goes belongs to another flagged quad, whose halfedge takes its place.
    """
    n = first + wp.tid()
    if flags[n] == wp.int64(1):
        sides = wp.vec4i()
        twins = wp.vec4i()
        for c in range(4):
            sides[c] = outer_side(mesh.twin, 4 * quads[n] + c)
            beyond = mesh.twin[sides[c]]
            if beyond >= 0:
                if mesh.face_gone[beyond >> 2] == wp.uint8(1):
                    beyond = mesh.twin[opposite_in_quad(beyond)]
            twins[c] = beyond
        sides_out[n] = sides
        twins_out[n] = twins


@wp.kernel
def stretch_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
    sides: wp.array(dtype=wp.vec4i),
    twins: wp.array(dtype=wp.vec4i),
    # Out:
    seams_out: wp.array(dtype=wp.int32),
) -> None:
    """Give the flagged quads the outer vertices and their twins. One thread per quad of the list.

    An outer vertex whose halfedge goes with one of this quad's neighbours gets this quad's.
    """
    n = first + wp.tid()
    for c in range(4):
        seams_out[4 * n + c] = -1
        if flags[n] == wp.int64(1):
            h = 4 * quads[n] + c
            side = sides[n][c]
            o = mesh.corners[side]
            leaving = mesh.vertex_halfedge[o]
            if (leaving >> 2) == (side >> 2) or (leaving >> 2) == (sides[n][(c + 3) & 3] >> 2):
                mesh.vertex_halfedge[o] = h
            mesh.corners[h] = o
            beyond = twins[n][c]
            mesh.twin[h] = beyond
            if beyond >= 0:
                mesh.twin[beyond] = h
                seams_out[4 * n + c] = h


@wp.kernel
def lower_outer_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
) -> None:
    """Take one mesh edge from each vertex of the stretched quads. One thread per quad; launched whole."""
    n = first + wp.tid()
    if flags[n] == wp.int64(1):
        for c in range(4):
            wp.atomic_sub(mesh.valence, mesh.corners[4 * quads[n] + c], 1)


@wp.kernel
def subtract_kernel(
    # In:
    first: wp.int32,
    flags: wp.array(dtype=wp.int64),
    others: wp.array(dtype=wp.int64),
    # Out:
    difference_out: wp.array(dtype=wp.int64),
) -> None:
    """Keep the flags that are not set in a second array. One thread per flag."""
    n = first + wp.tid()
    difference_out[n] = flags[n] - others[n]
