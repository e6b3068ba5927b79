r"""Remove quads with the valence pattern 3-X-3-Y (Grosso & Zint 2021, section 4.1).

    s1 ------- X ------- s2    Quad (v1, X, v2, Y): v1 and v2 have valence 3, X and Y at least 5. It
    |   A1   /   \   A2   |    goes, and v1 and v2 become one vertex m at the midpoint of X and Y. Its
    p1 --- v1  q  v2 --- p2    four neighbours stay: A1 and B1 with v1 and the outer vertex p1, A2 and
    |   B1   \   /   B2   |    B2 with v2 and p2. X and Y lose one mesh edge each, m has four.
    t1 ------- Y ------- t2

Two rules decide which quads go. Neither lets two neighbours go.

`paper`: the coloured pass removes a quad if no neighbour with the pattern has a colour at or below its own;
the counter pass, if none of its vertices of valence 3 belongs to another quad with the pattern, which is to
say that no neighbour has it. Quads at a boundary or at a non-manifold edge, and their neighbours, are
skipped, but still hold others back.

`safe`: beyond that no removal may make a mesh edge with more than two quads (p1 = p2), or turn a neighbour's
normal by 90 degrees. Quads that could touch each other's
neighbours do not go at once: the one with the lowest key goes first, in sweeps until none is left. So what
was checked still holds when it happens.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import mask_length, order_key
from dmc_cli.field import prefetch_neighbors
from dmc_cli.mesh import COLOR, MeshArrays, WorkingMesh, is_skipped, opposite_in_quad

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LEAST_X = wp.constant(5)
"""Smallest valence of X and Y, which lose a mesh edge each."""

NO_CUT = wp.constant(-1)
"""Stands for a quad that does not go."""

REFUSED = wp.constant(-2)
"""Stands for a quad that the safe rules keep."""

LISTED_A_CHUNK = 4
"""Words of 32 listed quads a chunk at least: memory is slow where they lie."""


def choose_by_paper(mesh: WorkingMesh, quads: Any, *, by_color: bool) -> Any:
    """Return the cuts of those quads with the pattern that go under the papers' rules, int32.

    Args:
        mesh: The mesh.
        quads: All quads with the pattern.
        by_color: The coloured pass, else the counter pass.
    """
    cuts = mesh.device.empty(quads.shape[0], wp.int32)
    color = mesh.face_values[COLOR] if by_color else mesh.arrays.defect
    inputs = [mesh.arrays, quads, color, by_color]
    mesh.device.launch(choose_by_paper_kernel, mask_length(quads.shape[0]), inputs, [cuts], LISTED_A_CHUNK)
    return cuts


def judge_topology(mesh: WorkingMesh, quads: Any, state: Any) -> tuple[Any, Any]:
    """Return the cuts of the quads that may go as far as the connectivity tells, and how many are refused.

    Args:
        mesh: The mesh.
        quads: Quads that have, or had, the pattern.
        state: uint8 (Q,); afterwards 1 for those of the quads that may go, 0 for the others of them.

    Returns:
        The cuts, int32, and the numbers of quads refused, int32, one for 32 of the list.
    """
    device, count = mesh.device, quads.shape[0]
    cuts, refused = device.empty(count, wp.int32), device.empty(mask_length(count), wp.int32)
    outputs = [state, cuts, refused]
    device.launch(judge_topology_kernel, mask_length(count), [mesh.arrays, quads], outputs, LISTED_A_CHUNK)
    return cuts, refused


def choose_apart(mesh: WorkingMesh, cuts: Any, state: Any) -> tuple[Any, Any]:
    """Return the cuts of quads that go at once, no two within two steps from quad to quad.

    Args:
        mesh: The mesh.
        cuts: Those of all quads that may go.
        state: uint8 (Q,), 1 for those.

    Returns:
        The cuts, int32, and a mask of those that have to wait.
    """
    device, count = mesh.device, cuts.shape[0]
    chosen, waiting = device.empty(count, wp.int32), device.empty(mask_length(count), wp.uint32)
    inputs = [mesh.arrays, cuts, state]
    device.launch(choose_apart_kernel, mask_length(count), inputs, [chosen, waiting], LISTED_A_CHUNK)
    return chosen, waiting


@wp.func
def cut_of(corners: wp.array(dtype=wp.int32), valence: wp.array(dtype=wp.int32), q: wp.int32) -> wp.int32:
    """Return the cut of a quad with the pattern, `NO_CUT` without the pattern."""
    a = valence[corners[4 * q]]
    b = valence[corners[4 * q + 1]]
    c = valence[corners[4 * q + 2]]
    d = valence[corners[4 * q + 3]]
    if a == 3 and c == 3 and b >= LEAST_X and d >= LEAST_X:
        return 4 * q
    if b == 3 and d == 3 and a >= LEAST_X and c >= LEAST_X:
        return 4 * q + 1
    return NO_CUT


@wp.func
def paper_cut(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    defect: wp.array(dtype=wp.uint8),
    color: wp.array(dtype=wp.uint8),
    by_color: wp.bool,
    q: wp.int32,
) -> wp.int32:
    """Return the cut of a quad with the pattern that goes by colour or, without, as no neighbour has it."""
    if is_skipped(twin, defect, q):
        return NO_CUT
    for c in range(4):
        neighbor = twin[4 * q + c] >> 2
        if cut_of(corners, valence, neighbor) != NO_CUT and (not by_color or color[neighbor] <= color[q]):
            return NO_CUT
    return cut_of(corners, valence, q)


@wp.kernel
def choose_by_paper_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    color: wp.array(dtype=wp.uint8),
    by_color: wp.bool,
    # Out:
    cuts_out: wp.array(dtype=wp.int32),
) -> None:
    """Choose by the papers' rules. One thread per 32 quads of the list."""
    start = 32 * (first + wp.tid())
    for n in range(start, wp.min(start + 32, quads.shape[0])):
        cuts_out[n] = paper_cut(mesh.corners, mesh.twin, mesh.valence, mesh.defect, color, by_color, quads[n])


@wp.func
def safe_cut(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    defect: wp.array(dtype=wp.uint8),
    q: wp.int32,
) -> wp.int32:
    """Return the cut of a quad that is there; `NO_CUT` without the pattern; `REFUSED`.

    Refused is what would join m to one vertex by two edges, p1 = p2. Nothing else can go wrong: any other way
    to a vertex twice in a quad, or to two quads with the same vertices, takes a side that two quads run along
    in the same direction. Each has a twin, so the side is on a non-manifold edge, and the quad is skipped.
    """
    h = cut_of(corners, valence, q)
    if h == NO_CUT:
        return NO_CUT
    if is_skipped(twin, defect, q):
        return NO_CUT
    p1 = corners[opposite_in_quad(twin[h])]
    p2 = corners[opposite_in_quad(twin[opposite_in_quad(h)])]
    if p1 == p2:
        return REFUSED
    return h


@wp.kernel
def judge_topology_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    # Out:
    state_out: wp.array(dtype=wp.uint8),
    cuts_out: wp.array(dtype=wp.int32),
    refused_out: wp.array(dtype=wp.int32),
) -> None:
    """Judge by connectivity which quads may go. One thread per 32 quads of the list."""
    word = first + wp.tid()
    refused = wp.int32(0)
    end = wp.min(32 * word + 32, quads.shape[0])
    for n in range(32 * word, end):
        prefetch_neighbors(mesh.corners, mesh.twin, quads[n])
    for n in range(32 * word, end):
        q = quads[n]
        h = wp.int32(NO_CUT)
        if mesh.face_gone[q] == wp.uint8(0):
            h = safe_cut(mesh.corners, mesh.twin, mesh.valence, mesh.defect, q)
        refused += wp.where(h == REFUSED, 1, 0)
        state_out[q] = wp.uint8(wp.where(h >= 0, 1, 0))
        cuts_out[n] = wp.max(h, NO_CUT)
    refused_out[word] = refused


@wp.func
def is_ahead(state: wp.array(dtype=wp.uint8), other: wp.int32, q: wp.int32) -> wp.bool:
    """Return whether another quad may go and has a lower key."""
    return state[other] != wp.uint8(0) and order_key(other) < order_key(q)


@wp.func
def comes_first(twin: wp.array(dtype=wp.int32), state: wp.array(dtype=wp.uint8), q: wp.int32) -> wp.bool:
    """Return whether no quad within two steps that may go has a lower key."""
    for c in range(4):
        t = twin[4 * q + c]
        if is_ahead(state, t >> 2, q):
            return False
        for step in range(1, 4):
            if is_ahead(state, twin[(t & ~3) | ((t + step) & 3)] >> 2, q):
                return False
    return True


@wp.kernel
def choose_apart_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    cuts: wp.array(dtype=wp.int32),
    state: wp.array(dtype=wp.uint8),
    # Out:
    chosen_out: wp.array(dtype=wp.int32),
    waiting_out: wp.array(dtype=wp.uint32),
) -> None:
    """Choose the quads with the lowest key within two steps. One thread per 32 quads of the list."""
    word = first + wp.tid()
    waiting = wp.uint32(0)
    for n in range(32 * word, wp.min(32 * word + 32, cuts.shape[0])):
        h = cuts[n]
        if h >= 0:
            if not comes_first(mesh.twin, state, h >> 2):
                h = NO_CUT
                waiting |= wp.uint32(1) << wp.uint32(n - 32 * word)
        chosen_out[n] = h
    waiting_out[word] = waiting
