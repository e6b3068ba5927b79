"""Take a mesh itself for the surface that its vertices are on, where there is no field.

The surface near a vertex of the fine mesh is the plane there, at right angles to the vertex's normal. It is
off the true surface by as little as the fine quads are. What else decimation needs of a grid, boxes to divide
the mesh into, it finds in one that is laid round the mesh.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.field import Field, grid_of
from dmc_cli.mesh import Mesh, Placement, SurfaceFrame, vertex_normals

MOST_CELLS = 4096
"""Cells along the longest side of the grid."""


def own_placement(mesh: Mesh) -> Placement:
    """Return where vertices lie in a grid round the mesh, of cells as large as quads; there is no field."""
    points = mesh.positions.numpy().astype(np.float64)
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    corners = points[mesh.faces.numpy()]
    side = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).mean()
    cell = max(float(side), float(extent.max()) / MOST_CELLS) or 1.0
    affine = np.diag([cell, cell, cell, 1.0])
    affine[:3, 3] = low - 0.5 * cell
    nx, ny, nz = (int(n) + 3 for n in extent / cell)
    at = (points - affine[:3, 3]) / cell
    node = np.floor(at).astype(np.int64)
    number = node[:, 0] + nx * (node[:, 1] + ny * node[:, 2])
    local = np.clip(at - node, 0.0, 1.0).astype(np.float32)
    device, name = mesh.device, mesh.device.name
    frame = SurfaceFrame(Field(), grid_of((nx, ny, nz), 0), affine, device.empty(0, wp.float64), 1.0, device)
    return Placement(
        wp.array(number, dtype=wp.int64, device=name), wp.array(local, dtype=wp.vec3, device=name), frame
    )


def own_normals(mesh: Mesh) -> Any:
    """Return the vertices' unit normals, vec3 (V,), 0 where there is none."""
    normals = vertex_normals(mesh.positions.numpy(), mesh.faces.numpy()).astype(np.float32)
    return wp.array(normals, dtype=wp.vec3, device=mesh.device.name)
