"""Find the quads with a defect: a side without a twin, or with two vertices that more than two quads join.

Simplification leaves them and their neighbours alone. Where the mesh comes from a grid its connectivity tells
(`grid_twins.py`); here the vertex pairs are sorted.
"""

import numpy as np
import warp as wp

from dmc_cli.mesh.mesh import DEFECT, Mesh


def with_defects(mesh: Mesh) -> Mesh:
    """Return a connected mesh of quads with its defects, uint8 (F,); the mesh itself if it knows them."""
    if DEFECT in mesh.face_values:
        return mesh
    quads, twin = mesh.faces.numpy().reshape(-1, 4).astype(np.int64), mesh.require_halfedges().twin.numpy()
    ends = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, pair, uses = np.unique(ends[:, 0] << 32 | ends[:, 1], return_inverse=True, return_counts=True)
    defect = ((twin < 0) | (uses[pair] > 2)).reshape(-1, 4).any(axis=1)
    values = wp.array(defect.astype(np.uint8), dtype=wp.uint8, device=mesh.device.name)
    return mesh.with_face_values({DEFECT: values})
