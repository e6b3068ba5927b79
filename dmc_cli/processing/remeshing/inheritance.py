"""Give new quads and vertices the values of what they were split from: labels above all."""

import warp as wp

from dmc_cli.mesh import COLOR, COLOR24, MeshArrays, WorkingMesh, copy_values, next_outgoing, quad_corner
from dmc_cli.processing.remeshing.regions import FROZEN

wp.set_module_options({"enable_backward": False})

OWN = {COLOR, COLOR24, FROZEN}
"""Values that new items have of their own: 0."""


def inherit_values(mesh: WorkingMesh, vertices: int, faces: int) -> None:
    """Copy values to the vertices from `vertices` on and the faces from `faces` on, which are new.

    A vertex takes those of the first older one on its edges, a face those of the first older one across its
    sides. What has no such neighbour keeps what it has, 0.
    """
    for kernel, first, count, values in (
        (find_older_vertices_kernel, vertices, mesh.vertex_count, mesh.vertex_values),
        (find_older_faces_kernel, faces, mesh.face_count, mesh.face_values),
    ):
        inherited = [found for name, found in values.items() if name not in OWN]
        if inherited and count > first:
            device = mesh.device
            items, older = device.empty(count - first, wp.int32), device.empty(count - first, wp.int32)
            device.launch(kernel, count - first, [mesh.arrays, first], [items, older])
            for found in inherited:
                copy_values(device, items, older, found, found)


@wp.kernel
def find_older_vertices_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    begin: wp.int32,
    # Out:
    items_out: wp.array(dtype=wp.int32),
    older_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the first neighbour of each new vertex that is older, or take itself. One thread a vertex."""
    n = first + wp.tid()
    v = begin + n
    older = int(-1)
    if mesh.vertex_gone[v] == wp.uint8(0):
        h = mesh.vertex_halfedge[v]
        for _edge in range(mesh.valence[v]):
            neighbor = quad_corner(mesh.corners, h, 1)
            if older < 0 and neighbor < begin:
                older = neighbor
            h = next_outgoing(mesh.twin, h)
    items_out[n] = v
    older_out[n] = wp.where(older < 0, v, older)


@wp.kernel
def find_older_faces_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    begin: wp.int32,
    # Out:
    items_out: wp.array(dtype=wp.int32),
    older_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the first face across a side of each new one that is older, or take itself. One thread a face."""
    n = first + wp.tid()
    f = begin + n
    older = int(-1)
    if mesh.face_gone[f] == wp.uint8(0):
        for c in range(4):
            t = mesh.twin[4 * f + c]
            if older < 0 and t >= 0 and (t >> 2) < begin:
                older = t >> 2
    items_out[n] = f
    older_out[n] = wp.where(older < 0, f, older)
