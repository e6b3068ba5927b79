"""Connect the faces of any mesh: twins by vertices, and a halfedge and the valence of each vertex."""

from dataclasses import replace
from typing import Any

import warp as wp

from dmc_cli.mesh.halfedges import Halfedges, previous_halfedge
from dmc_cli.mesh.mesh import Mesh, require_mesh
from dmc_cli.mesh.twins import find_twins

wp.set_module_options({"enable_backward": False})

INNER = wp.constant(wp.uint32(0x80000000))
"""Added to a halfedge with a twin where the least is looked for: those without one come first."""

NOWHERE = wp.constant(wp.uint32(0xFFFFFFFF))
"""What stands for the halfedge of a vertex of no face."""


def connect(mesh: Mesh) -> Mesh:
    """Return the mesh with halfedges; the mesh itself if it has them.

    Twins are those of `find_twins`. A vertex takes the lowest of its outgoing halfedges without a twin, else
    the lowest of all.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    if require_mesh(mesh).halfedges is not None:
        return mesh
    return connect_by(mesh, find_twins(mesh.device, mesh.faces, mesh.vertex_count))


def connect_by(mesh: Mesh, twin: Any) -> Mesh:
    """Return the mesh with halfedges by their twins, int32 (4F,), -1 where there is none."""
    device = mesh.device
    valence = device.zeros(mesh.vertex_count, wp.int32)
    lowest = wp.full(mesh.vertex_count, NOWHERE, dtype=wp.uint32, device=device.name)
    inputs = [mesh.corners, twin]
    device.launch_whole(gather_halfedges_kernel, 4 * mesh.face_count, inputs, [valence, lowest])
    start = device.empty(mesh.vertex_count, wp.int32)
    device.launch(choose_halfedges_kernel, mesh.vertex_count, [lowest], [start])
    return replace(mesh, halfedges=Halfedges(twin, start, valence))


@wp.kernel
def gather_halfedges_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    # In/out:
    valence_inout: wp.array(dtype=wp.int32),
    lowest_inout: wp.array(dtype=wp.uint32),
) -> None:
    """Count each vertex's mesh edges and find its lowest halfedge. One thread per corner; not for chunks.

    An edge of a vertex is an outgoing halfedge, or an incoming one without a twin. Sums and minima of
    integers: the order of the threads does not show.
    """
    h = first + wp.tid()
    v = corners[h]
    if v >= 0:
        edges = int(1)
        if twin[previous_halfedge(corners, h)] < 0:
            edges = 2
        wp.atomic_add(valence_inout, v, edges)
        key = wp.uint32(h)
        if twin[h] >= 0:
            key += INNER
        wp.atomic_min(lowest_inout, v, key)


@wp.kernel
def choose_halfedges_kernel(
    # In:
    first: wp.int32,
    lowest: wp.array(dtype=wp.uint32),
    # Out:
    start_out: wp.array(dtype=wp.int32),
) -> None:
    """Read the halfedges from their keys. One thread per vertex."""
    v = first + wp.tid()
    start_out[v] = wp.where(lowest[v] == NOWHERE, -1, wp.int32(lowest[v] & ~INNER))
