"""Shapes of `tests/shapes.py` as the stages of simplification see a mesh, without grid and field."""

import numpy as np
import warp as wp

from dmc_cli.mesh.twins import pair_halfedges
from dmc_cli.mesh.working import MeshArrays, WorkingMesh
from dmc_cli.runtime.device import Device
from tests.oracle.edges import vertex_pairs
from tests.oracle.halfedges import NO_TWIN, valences


def working(shape, device="cpu"):
    """Return the working mesh of a shape of quads."""
    points, quads = shape
    twin = pair_halfedges(quads).astype(np.int32)
    _, pair, use = np.unique(vertex_pairs(quads), return_inverse=True, return_counts=True)
    defect = ((use[pair] > 2) | (twin == NO_TWIN)).reshape(-1, 4).any(axis=1)
    start = np.zeros(len(points), np.int32)
    start[quads.ravel()[::-1]] = np.arange(quads.size, dtype=np.int32)[::-1]
    start[quads.ravel()[twin == NO_TWIN]] = np.flatnonzero(twin == NO_TWIN)
    mesh = MeshArrays()
    mesh.corners = _on(device, quads.ravel(), wp.int32)
    mesh.twin = _on(device, twin, wp.int32)
    mesh.defect = _on(device, defect, wp.uint8)
    mesh.face_gone = _on(device, np.zeros(len(quads)), wp.uint8)
    mesh.vertex_halfedge = _on(device, start, wp.int32)
    mesh.valence = _on(device, valences(quads, twin, len(points)), wp.int32)
    mesh.vertex_gone = _on(device, np.zeros(len(points)), wp.uint8)
    mesh.position = wp.array(points.astype(np.float32), dtype=wp.vec3, device=device)
    on_device = Device(device, 2)
    return WorkingMesh(mesh, None, {}, {}, on_device)


def _on(device, values, dtype):
    kind = np.uint8 if dtype is wp.uint8 else np.int32
    return wp.array(np.ascontiguousarray(values, dtype=kind), dtype=dtype, device=device)


def numbers(device, *items):
    """Return a list of quads on a device."""
    return _on(device, np.array(items), wp.int32)
