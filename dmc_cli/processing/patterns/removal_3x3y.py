"""Remove the quads that were chosen for it: 3-X-3-Y (names as in `simplify_3x3y.py`).

Placing the merged vertex, judging folds and changing the mesh is one kernel, so that what lies scattered in
memory is fetched once. Quads that go at once are so far apart that no thread reads what another one writes:
under the papers' rules they are no neighbours, and only their own vertices are looked at; under the safe
rules they are three steps apart, and their neighbours' vertices are.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import keep_masked, mask_length
from dmc_cli.field import (
    Field,
    Grid,
    GridPoint,
    kernel_matrix,
    node_cell,
    output_position,
    prefetch_around_cuts,
)
from dmc_cli.mesh import (
    COLOR,
    MeshArrays,
    WorkingMesh,
    next_in_quad,
    next_outgoing,
    opposite_in_quad,
    previous_in_quad,
    set_twins,
)
from dmc_cli.processing.patterns.merged_vertices import folds, merged_point
from dmc_cli.processing.patterns.simplify_3x3y import LISTED_A_CHUNK
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


def remove_3x3y(
    mesh: WorkingMesh, cuts: Any, *, project: bool, safe: bool, state: Any | None = None
) -> tuple[Any, Any]:
    """Remove quads.

    Args:
        mesh: The mesh, changed in place.
        cuts: Cuts, int32, of quads that are no neighbours of each other.
        project: Put merged vertices on the surface.
        safe: Refuse what would turn a neighbour over; else mark edges that become non-manifold.
        state: uint8 (Q,) of the safe rules, 1 for quads that may go; 0 afterwards for those refused.

    Returns:
        The numbers of quads that went and of those that were refused, int32, one for 32 of the list.
    """
    device, frame, count = mesh.device, mesh.frame, cuts.shape[0]
    words = mask_length(count)
    removed, refused = device.empty(words, wp.int32), device.empty(words, wp.int32)
    seams, clashes = device.empty(2 * count, wp.int32), device.empty(2 * words, wp.uint32)
    color = mesh.face_values.get(COLOR)
    inputs = [mesh.arrays, frame.grid.struct(), frame.field, kernel_matrix(frame.affine)]
    inputs += [frame.depths, project, safe, mesh.arrays.defect if color is None else color, cuts]
    inputs.append(mesh.arrays.face_gone if state is None else state)
    device.launch(remove_3x3y_kernel, words, inputs, [removed, refused, seams, clashes], LISTED_A_CHUNK)
    if not safe:
        device.launch(mark_nonmanifold_kernel, count, [mesh.arrays, cuts], [], 32 * LISTED_A_CHUNK)
    if color is not None:
        mesh.seams.append(keep_masked(device, seams, clashes))
    return removed, refused


@wp.func_native(native(__file__, "lower_valence"))
def lower_valence(valence: wp.array(dtype=wp.int32), v: wp.int32) -> None:
    """Take one mesh edge from a vertex, as several threads may do at once.

    In C++, as Warp's own atomics are plain loads and stores on CPU.
    """
    ...


@wp.func
def cut_out(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    vertex_halfedge: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    h: wp.int32,
) -> None:
    """Merge the origins of halfedge h of a quad, which stays, and of the opposite halfedge, which goes.

    It writes to halfedges of the quad's neighbours that face the quad or start at the vertex that goes, and
    to the quad's own four vertices: nothing that another thread reads, but for valences of X and Y.
    """
    kept = corners[h]
    at_x = next_in_quad(h)  # X to v2
    at_y = previous_in_quad(h)  # Y to v1
    to_y = opposite_in_quad(h)  # v2 to Y
    # v2's other two halfedges start at m from now on
    corners[twin[at_x]] = kept
    corners[next_in_quad(twin[to_y])] = kept
    x = corners[at_x]
    y = corners[at_y]
    vertex_halfedge[kept] = next_in_quad(twin[h])
    if vertex_halfedge[x] == at_x:
        vertex_halfedge[x] = next_in_quad(twin[at_x])
    if vertex_halfedge[y] == at_y:
        vertex_halfedge[y] = next_in_quad(twin[at_y])
    set_twins(twin, twin[h], twin[at_x])
    set_twins(twin, twin[to_y], twin[at_y])
    valence[kept] = 4
    lower_valence(valence, x)
    lower_valence(valence, y)


@wp.func
def merge_ends(
    mesh: MeshArrays,
    grid: Grid,
    color: wp.array(dtype=wp.uint8),
    cut: wp.int32,
    point: GridPoint,
    target: wp.vec3,
    n: wp.int32,
    seams_out: wp.array(dtype=wp.int32),
) -> wp.int32:
    """Remove the quad of cut n; return a bit for each of its two seams that has one colour on both sides."""
    h = wp.where(mesh.corners[cut] > mesh.corners[opposite_in_quad(cut)], opposite_in_quad(cut), cut)
    kept = mesh.corners[h]
    mesh.position[kept] = target
    mesh.cell[kept] = node_cell(grid, point.cell)
    mesh.local[kept] = point.local
    mesh.face_gone[h >> 2] = wp.uint8(1)
    mesh.vertex_gone[mesh.corners[opposite_in_quad(h)]] = wp.uint8(1)
    seam_x = mesh.twin[h]
    seam_y = mesh.twin[opposite_in_quad(h)]
    cut_out(mesh.corners, mesh.twin, mesh.vertex_halfedge, mesh.valence, h)
    seams_out[2 * n] = seam_x
    seams_out[2 * n + 1] = seam_y
    clash = wp.where(color[seam_x >> 2] == color[mesh.twin[seam_x] >> 2], 1, 0)
    return clash | wp.where(color[seam_y >> 2] == color[mesh.twin[seam_y] >> 2], 2, 0)


@wp.kernel
def remove_3x3y_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    depths: wp.array(dtype=wp.float64),
    project: wp.bool,
    safe: wp.bool,
    color: wp.array(dtype=wp.uint8),
    cuts: wp.array(dtype=wp.int32),
    # In/out:
    state_inout: wp.array(dtype=wp.uint8),
    # Out:
    removed_out: wp.array(dtype=wp.int32),
    refused_out: wp.array(dtype=wp.int32),
    seams_out: wp.array(dtype=wp.int32),
    clashes_out: wp.array(dtype=wp.uint32),
) -> None:
    """Merge v1 and v2 to the lower number; find where neighbours get one colour. One thread per 32 quads."""
    word = first + wp.tid()
    removed = wp.int32(0)
    refused = wp.int32(0)
    clashes = wp.uint64(0)
    end = wp.min(32 * word + 32, cuts.shape[0])
    prefetch_around_cuts(
        grid, field, mesh.corners, mesh.twin, mesh.position, mesh.cell, mesh.local, cuts, 32 * word, end
    )
    for n in range(32 * word, end):
        h = cuts[n]
        if h >= 0:
            point = merged_point(grid, field, mesh.corners, mesh.cell, mesh.local, h, project)
            target = output_position(matrix, depths, point.cell, point.local)
            refuses = wp.bool(False)
            if safe:
                refuses = folds(mesh.corners, mesh.twin, mesh.position, h, target)
            if refuses:
                refused += 1
                state_inout[h >> 2] = wp.uint8(0)
            else:
                removed += 1
                clash = merge_ends(mesh, grid, color, h, point, target, n, seams_out)
                clashes |= wp.uint64(clash) << wp.uint64(2 * (n - 32 * word))
    removed_out[word] = removed
    refused_out[word] = refused
    clashes_out[2 * word] = wp.uint32(clashes)
    clashes_out[2 * word + 1] = wp.uint32(clashes >> wp.uint64(32))


@wp.kernel
def mark_nonmanifold_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    cuts: wp.array(dtype=wp.int32),
) -> None:
    """Mark the quads beside mesh edges that join a merged vertex twice to another. One thread per quad.

    No other edge can have become non-manifold; all writes are of the same value.
    """
    h = cuts[first + wp.tid()]
    if h >= 0:
        m = wp.min(mesh.corners[h], mesh.corners[opposite_in_quad(h)])
        here = mesh.vertex_halfedge[m]
        for _n in range(4):
            other = next_outgoing(mesh.twin, here)
            for _rest in range(3):
                if mesh.corners[next_in_quad(other)] == mesh.corners[next_in_quad(here)]:
                    mesh.defect[here >> 2] = wp.uint8(1)
                    mesh.defect[mesh.twin[here] >> 2] = wp.uint8(1)
                other = next_outgoing(mesh.twin, other)
            here = next_outgoing(mesh.twin, here)
