"""Where the merged vertex of a 3-X-3-Y quad goes, and whether it may: the safe rules.

Names are those of `simplify_3x3y.py`. The papers put the vertex at the midpoint of X and Y and check nothing.
With `--project` it goes on to the surface. A point without a cell that exists, or from which the surface is
not found, gives way to the nearer of v1 and v2, which lie on the surface.
"""

from typing import Any

import warp as wp

from dmc_cli.device import ITEMS_A_SLAB
from dmc_cli.mesh.halfedges import next_halfedge, previous_halfedge
from dmc_cli.mesh.project import GridPoint, cell_node, index_position, locate_point, node_cell, project_point
from dmc_cli.mesh.simplify_3x3y import corner_3x3y
from dmc_cli.mesh.working_mesh import MeshArrays, WorkingMesh, is_skipped, opposite_halfedge
from dmc_cli.surface.field import Field
from dmc_cli.surface.grid import Grid
from dmc_cli.surface.slices import map_vertices

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


def place_merged(mesh: WorkingMesh, quads: Any, flags: Any, *, project: bool) -> tuple[Any, Any, Any]:
    """Return position (vec3), cell (int64) and local coordinates (vec3) of the merged vertices.

    Args:
        mesh: The mesh.
        quads: Quads with the pattern.
        flags: int64, 1 for those that are wanted; the others' values are undefined.
        project: Put the point on the surface.
    """
    device, surface, count = mesh.device, mesh.surface, quads.shape[0]
    cell, local = device.empty(count, wp.int64), device.empty(count, wp.vec3)
    inputs = [mesh.arrays, surface.grid.struct(), surface.field, project, quads, flags]
    device.launch(place_merged_kernel, count, inputs, [cell, local], ITEMS_A_SLAB)
    position = map_vertices(cell, local, surface.depths, surface.grid, surface.affine, device)
    return position, cell, local


def judge_topology(mesh: WorkingMesh, quads: Any) -> tuple[Any, Any]:
    """Return which quads may go as far as the connectivity tells, and which are refused, int64 flags."""
    device, count = mesh.device, quads.shape[0]
    eligible, refused = device.empty(count, wp.int64), device.empty(count, wp.int64)
    device.launch(judge_topology_kernel, count, [mesh.arrays, quads], [eligible, refused], ITEMS_A_SLAB)
    return eligible, refused


def judge_folds(mesh: WorkingMesh, quads: Any, position: Any, chosen: Any, refused: Any) -> None:
    """Refuse the chosen quads whose merged vertex would turn a neighbour over; flags change in place."""
    inputs = [mesh.arrays, quads, position]
    mesh.device.launch(judge_folds_kernel, quads.shape[0], inputs, [chosen, refused], ITEMS_A_SLAB)


@wp.kernel
def place_merged_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    grid: Grid,
    field: Field,
    project: wp.bool,
    quads: wp.array(dtype=wp.int32),
    flags: wp.array(dtype=wp.int64),
    # Out:
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
):
    """Place the merged vertices. One thread a quad of the list."""
    n = first + wp.tid()
    cell_out[n] = wp.int64(0)
    local_out[n] = wp.vec3()
    if flags[n] == wp.int64(1):
        h = 4 * quads[n] + corner_3x3y(mesh, quads[n])
        x = mesh.corners[next_halfedge(h)]
        y = mesh.corners[previous_halfedge(h)]
        at_x = index_position(grid, mesh.cell[x], mesh.local[x])
        middle = wp.float64(0.5) * (at_x + index_position(grid, mesh.cell[y], mesh.local[y]))
        point = GridPoint()
        if project:
            point = project_point(field, grid, middle)
        else:
            point = locate_point(field, grid, middle)
        if not point.is_found:
            v = mesh.corners[h]
            other = mesh.corners[opposite_halfedge(h)]
            near = wp.length_sq(index_position(grid, mesh.cell[v], mesh.local[v]) - middle)
            if wp.length_sq(index_position(grid, mesh.cell[other], mesh.local[other]) - middle) < near:
                v = other
            point.cell = cell_node(grid, mesh.cell[v])
            point.local = mesh.local[v]
        cell_out[n] = node_cell(grid, point.cell)
        local_out[n] = point.local


@wp.kernel
def judge_topology_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    # Out:
    eligible_out: wp.array(dtype=wp.int64),
    refused_out: wp.array(dtype=wp.int64),
):
    """Refuse what would make a crowded mesh edge, or a quad or vertex twice. One thread a quad."""
    n = first + wp.tid()
    q = quads[n]
    corner = corner_3x3y(mesh, q)
    eligible = bool(False)
    refused = bool(False)
    if corner >= 0 and mesh.quad_gone[q] == wp.uint8(0) and not is_skipped(mesh, q):
        h = 4 * q + corner
        v1 = mesh.corners[h]
        v2 = mesh.corners[opposite_halfedge(h)]
        x = mesh.corners[next_halfedge(h)]
        y = mesh.corners[previous_halfedge(h)]
        a1 = mesh.twin[h]
        a2 = mesh.twin[next_halfedge(h)]
        b2 = mesh.twin[opposite_halfedge(h)]
        b1 = mesh.twin[previous_halfedge(h)]
        p1 = mesh.corners[opposite_halfedge(a1)]
        s1 = mesh.corners[previous_halfedge(a1)]
        t1 = mesh.corners[opposite_halfedge(b1)]
        p2 = mesh.corners[opposite_halfedge(b2)]
        t2 = mesh.corners[previous_halfedge(b2)]
        s2 = mesh.corners[opposite_halfedge(a2)]
        refused = p1 == p2 or x == y
        refused = refused or p1 == v2 or s1 == v2 or t1 == v2 or p2 == v1 or s2 == v1 or t2 == v1
        refused = refused or (s1 == p2 and s2 == p1) or (t1 == p2 and t2 == p1)
        refused = refused or (s1 == y and t1 == x) or (s2 == y and t2 == x)
        eligible = not refused
    eligible_out[n] = wp.int64(wp.where(eligible, 1, 0))
    refused_out[n] = wp.int64(wp.where(refused, 1, 0))


@wp.func
def turns_over(mesh: MeshArrays, h: wp.int32, target: wp.vec3) -> wp.bool:
    """Return whether a quad's normal turns by 90 degrees or more if the origin of its halfedge h moves."""
    here = mesh.position[mesh.corners[h]]
    b = mesh.position[mesh.corners[next_halfedge(h)]]
    c = mesh.position[mesh.corners[opposite_halfedge(h)]]
    d = mesh.position[mesh.corners[previous_halfedge(h)]]
    before = wp.cross(c - here, d - b)
    return wp.dot(before, wp.cross(c - target, d - b)) <= 0.0 and wp.length_sq(before) > 0.0


@wp.kernel
def judge_folds_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    quads: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    # In/out:
    chosen_inout: wp.array(dtype=wp.int64),
    refused_inout: wp.array(dtype=wp.int64),
):
    """Refuse what would turn one of the four neighbours over. One thread a quad of the list."""
    n = first + wp.tid()
    if chosen_inout[n] == wp.int64(1):
        h = 4 * quads[n] + corner_3x3y(mesh, quads[n])
        target = position[n]
        folds = turns_over(mesh, next_halfedge(mesh.twin[h]), target)
        folds = folds or turns_over(mesh, mesh.twin[next_halfedge(h)], target)
        folds = folds or turns_over(mesh, next_halfedge(mesh.twin[opposite_halfedge(h)]), target)
        folds = folds or turns_over(mesh, mesh.twin[previous_halfedge(h)], target)
        if folds:
            chosen_inout[n] = wp.int64(0)
            refused_inout[n] = wp.int64(1)
