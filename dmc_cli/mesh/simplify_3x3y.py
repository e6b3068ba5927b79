r"""Removal of quads with the valence pattern 3-X-3-Y (Grosso & Zint 2021, section 4.1).

    s1 ------- X ------- s2    Quad (v1, X, v2, Y): v1 and v2 have valence 3, X and Y at least 5. It
    |   A1   /   \   A2   |    goes, and v1 and v2 become one vertex m at the midpoint of X and Y. Its
    p1 --- v1  q  v2 --- p2    four neighbours stay: A1 and B1 with v1 and the outer vertex p1, A2 and
    |   B1   \   /   B2   |    B2 with v2 and p2. X and Y lose one mesh edge each, m has four.
    t1 ------- Y ------- t2

Two rules decide which quads go. Neither lets two neighbours go.

`paper`: the coloured pass removes a quad if no neighbour with the pattern has a colour at or below its own;
the counter pass, if none of its vertices of valence 3 belongs to another quad with the pattern, which is to
say that no neighbour has it. Quads at a boundary or at a crowded vertex pair, and their neighbours, are
skipped, but still block others.

`safe`: beyond that no removal may make a mesh edge with more than two quads (p1 = p2), a second quad with the
same four vertices, or turn a neighbour's normal by 90 degrees. Quads that could touch each other's
neighbours do not go at once: the one with the lowest key goes first, in sweeps until none is left. So what
was checked still holds when it happens.
"""

from typing import Any

import warp as wp

from dmc_cli.device import ITEMS_A_SLAB, Device
from dmc_cli.mesh.halfedges import next_halfedge, previous_halfedge
from dmc_cli.mesh.selection import keep_flagged, list_mask, mask_length, turn_key
from dmc_cli.mesh.working_mesh import (
    MeshArrays,
    WorkingMesh,
    head,
    is_skipped,
    opposite_halfedge,
    set_twins,
    turned,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LEAST_X = wp.constant(5)
"""Smallest valence of X and Y, which lose a mesh edge each."""

NO_SEAM = -1
"""Stands in a list of new twins where no quad went."""


def list_3x3y(mesh: WorkingMesh) -> Any:
    """Return the quads with the pattern in ascending order, int32."""
    device = mesh.device
    mask = device.empty(mask_length(mesh.quad_count), wp.uint32)
    device.launch(find_3x3y_kernel, mask.shape[0], [mesh.arrays], [mask])
    return list_mask(device, mask)


def choose_by_paper(mesh: WorkingMesh, quads: Any, *, by_color: bool) -> Any:
    """Return which of the quads with the pattern go under the papers' rules, int64 flags.

    Args:
        mesh: The mesh.
        quads: All quads with the pattern.
        by_color: The coloured pass, else the counter pass.
    """
    flags = mesh.device.empty(quads.shape[0], wp.int64)
    color = mesh.color if by_color else mesh.arrays.defect
    mesh.device.launch(
        choose_3x3y_kernel, quads.shape[0], [mesh.arrays, quads, color, by_color], [flags], ITEMS_A_SLAB
    )
    return flags


def choose_apart(mesh: WorkingMesh, quads: Any, eligible: Any, state: Any) -> Any:
    """Return which of the eligible quads go at once, int64 flags: no two within two steps from quad to quad.

    Args:
        mesh: The mesh.
        quads: Quads with the pattern.
        eligible: int64 flags of those that may go.
        state: uint8 (Q,), a scratch array of zeros; left as zeros.
    """
    device, count = mesh.device, quads.shape[0]
    flags = device.empty(count, wp.int64)
    device.launch(mark_kernel, count, [quads, eligible, 1], [state], ITEMS_A_SLAB)
    device.launch(choose_apart_kernel, count, [mesh.arrays, quads, eligible, state], [flags], ITEMS_A_SLAB)
    device.launch(mark_kernel, count, [quads, eligible, 0], [state], ITEMS_A_SLAB)
    return flags


def remove_3x3y(
    mesh: WorkingMesh, quads: Any, flags: Any, targets: tuple[Any, Any, Any], *, may_crowd: bool = True
) -> None:
    """Remove the flagged quads.

    Args:
        mesh: The mesh, changed in place.
        quads: Quads with the pattern, no two flagged ones neighbours.
        flags: int64, 1 for those that go.
        may_crowd: Whether a merged vertex may be joined twice to another, as under the papers' rules.
        targets: For each quad the merged vertex's position (vec3), cell (int64) and local coordinates (vec3).
    """
    device, count = mesh.device, quads.shape[0]
    seams = device.empty(2 * count, wp.int32)
    device.launch(remove_3x3y_kernel, count, [mesh.arrays, quads, flags, *targets], [seams], ITEMS_A_SLAB)
    if count:
        # in one launch: on CPU an atomic is a plain load and store
        wp.launch(lower_valence_kernel, dim=count, inputs=[0, mesh.arrays, quads, flags], device=device.name)
    if may_crowd:
        device.launch(mark_crowded_kernel, count, [mesh.arrays, quads, flags], [], ITEMS_A_SLAB)
    mesh.seams.append(seams)


def still_waiting(device: Device, quads: Any, eligible: Any, gone: Any) -> Any:
    """Return the quads that were eligible but did not go."""
    waiting = device.empty(quads.shape[0], wp.int64)
    device.launch(subtract_kernel, quads.shape[0], [eligible, gone], [waiting], ITEMS_A_SLAB)
    return keep_flagged(device, quads, waiting)


@wp.func
def corner_3x3y(mesh: MeshArrays, q: wp.int32) -> wp.int32:
    """Return the first corner (0 or 1) of valence 3 of a quad with the pattern, -1 without the pattern."""
    a = mesh.valence[mesh.corners[4 * q]]
    b = mesh.valence[mesh.corners[4 * q + 1]]
    c = mesh.valence[mesh.corners[4 * q + 2]]
    d = mesh.valence[mesh.corners[4 * q + 3]]
    corner = int(-1)
    if a == 3 and c == 3 and b >= LEAST_X and d >= LEAST_X:
        corner = 0
    if b == 3 and d == 3 and a >= LEAST_X and c >= LEAST_X:
        corner = 1
    return corner


@wp.func
def has_3x3y(mesh: MeshArrays, q: wp.int32) -> wp.bool:
    """Return whether a quad that is there has the pattern."""
    return mesh.quad_gone[q] == wp.uint8(0) and corner_3x3y(mesh, q) >= 0


@wp.kernel
def find_3x3y_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    # Out:
    mask_out: wp.array(dtype=wp.uint32),
):
    """Find the quads with the pattern. One thread 32 quads."""
    w = first + wp.tid()
    word = wp.uint32(0)
    for q in range(32 * w, wp.min(32 * w + 32, mesh.quad_gone.shape[0])):
        if has_3x3y(mesh, q):
            word |= wp.uint32(1) << wp.uint32(q - 32 * w)
    mask_out[w] = word


@wp.kernel
def choose_3x3y_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    color: wp.array(dtype=wp.uint8),
    by_color: wp.bool,
    # Out:
    flags_out: wp.array(dtype=wp.int64),
):
    """Choose by colour or, without, where no neighbour has the pattern. One thread a quad with it."""
    n = first + wp.tid()
    q = quads[n]
    goes = bool(False)
    if not is_skipped(mesh, q):
        goes = bool(True)
        for c in range(4):
            neighbor = mesh.twin[4 * q + c] >> 2
            if has_3x3y(mesh, neighbor) and (not by_color or color[neighbor] <= color[q]):
                goes = bool(False)
    flags_out[n] = wp.int64(wp.where(goes, 1, 0))


@wp.kernel
def mark_kernel(
    # In:
    first: wp.int32,
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
    mark: wp.int32,
    # Out:
    state_out: wp.array(dtype=wp.uint8),
):
    """Mark the flagged quads. One thread a quad of the list."""
    n = first + wp.tid()
    if flags[n] == wp.int64(1):
        state_out[quads[n]] = wp.uint8(mark)


@wp.kernel
def choose_apart_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    eligible: wp.array(dtype=wp.int64),
    state: wp.array(dtype=wp.uint8),
    # Out:
    flags_out: wp.array(dtype=wp.int64),
):
    """Choose the eligible quads with the lowest key within two steps. One thread a quad of the list."""
    n = first + wp.tid()
    q = quads[n]
    goes = eligible[n] == wp.int64(1)
    if goes:
        key = turn_key(q)
        for c in range(4):
            t = mesh.twin[4 * q + c]
            if state[t >> 2] == wp.uint8(1) and turn_key(t >> 2) < key:
                goes = bool(False)
            for step in range(1, 4):
                beyond = mesh.twin[(t & ~3) | ((t + step) & 3)] >> 2
                if beyond != q and state[beyond] == wp.uint8(1) and turn_key(beyond) < key:
                    goes = bool(False)
    flags_out[n] = wp.int64(wp.where(goes, 1, 0))


@wp.kernel
def remove_3x3y_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
    position: wp.array(dtype=wp.vec3),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    # Out:
    seams_out: wp.array(dtype=wp.int32),
):
    """Merge the vertices of valence 3 of the flagged quads, the lower number stays. One thread a quad.

    A thread writes to halfedges of its own quad's neighbours that face the quad or start at the vertex that
    goes, and to its own four vertices: nothing that another thread reads or writes.
    """
    n = first + wp.tid()
    seams_out[2 * n] = NO_SEAM
    seams_out[2 * n + 1] = NO_SEAM
    if flags[n] == wp.int64(1):
        q = quads[n]
        h = 4 * q + corner_3x3y(mesh, q)  # v1 to X
        if mesh.corners[h] > mesh.corners[opposite_halfedge(h)]:
            h = opposite_halfedge(h)  # v1 has the lower number now
        kept = mesh.corners[h]
        gone = mesh.corners[opposite_halfedge(h)]
        at_x = next_halfedge(h)  # X to v2
        at_y = previous_halfedge(h)  # Y to v1
        to_y = opposite_halfedge(h)  # v2 to Y
        # v2's other two halfedges start at m from now on
        mesh.corners[mesh.twin[at_x]] = kept
        mesh.corners[next_halfedge(mesh.twin[to_y])] = kept
        x = mesh.corners[at_x]
        y = mesh.corners[at_y]
        mesh.vertex_halfedge[kept] = next_halfedge(mesh.twin[h])
        if mesh.vertex_halfedge[x] == at_x:
            mesh.vertex_halfedge[x] = next_halfedge(mesh.twin[at_x])
        if mesh.vertex_halfedge[y] == at_y:
            mesh.vertex_halfedge[y] = next_halfedge(mesh.twin[at_y])
        seams_out[2 * n] = mesh.twin[h]
        seams_out[2 * n + 1] = mesh.twin[to_y]
        set_twins(mesh, mesh.twin[h], mesh.twin[at_x])
        set_twins(mesh, mesh.twin[to_y], mesh.twin[at_y])
        mesh.position[kept] = position[n]
        mesh.cell[kept] = cell[n]
        mesh.local[kept] = local[n]
        mesh.quad_gone[q] = wp.uint8(1)
        mesh.vertex_gone[gone] = wp.uint8(1)


@wp.kernel
def lower_valence_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
):
    """Set the valences of the vertices of the quads that went: X and Y one less, m four. Not for slabs."""
    n = first + wp.tid()
    if flags[n] == wp.int64(1):
        h = 4 * quads[n]
        if mesh.vertex_gone[mesh.corners[h]] == wp.uint8(0):
            if mesh.vertex_gone[mesh.corners[h + 2]] == wp.uint8(0):
                h += 1
        wp.atomic_sub(mesh.valence, mesh.corners[next_halfedge(h)], 1)
        wp.atomic_sub(mesh.valence, mesh.corners[previous_halfedge(h)], 1)
        mesh.valence[wp.min(mesh.corners[h], mesh.corners[opposite_halfedge(h)])] = 4


@wp.kernel
def mark_crowded_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
):
    """Mark the quads beside mesh edges that join a merged vertex twice to another. One thread a removed quad.

    No other vertex pair can have become crowded; all writes are of the same value.
    """
    n = first + wp.tid()
    if flags[n] == wp.int64(1):
        h = 4 * quads[n]
        if mesh.vertex_gone[mesh.corners[h]] == wp.uint8(0):
            if mesh.vertex_gone[mesh.corners[h + 2]] == wp.uint8(0):
                h += 1
        m = wp.min(mesh.corners[h], mesh.corners[opposite_halfedge(h)])
        here = mesh.vertex_halfedge[m]
        for _turn in range(4):
            other = turned(mesh, here)
            for _rest in range(3):
                if head(mesh, other) == head(mesh, here):
                    mesh.defect[here >> 2] = wp.uint8(1)
                    mesh.defect[mesh.twin[here] >> 2] = wp.uint8(1)
                other = turned(mesh, other)
            here = turned(mesh, here)


@wp.kernel
def subtract_kernel(
    # In:
    first: wp.int32,
    flags: wp.array(dtype=wp.int64),
    others: wp.array(dtype=wp.int64),
    # Out:
    difference_out: wp.array(dtype=wp.int64),
):
    """Keep the flags that others do not have. One thread a flag."""
    n = first + wp.tid()
    difference_out[n] = flags[n] - others[n]
