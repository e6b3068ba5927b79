"""Compute the share of irregular vertices.

A vertex of a face is regular if it has four mesh edges, in a mesh of triangles only if it has six (Grosso &
Zint 2021, section 5.3). Vertices of no face are left out. This counts edges as halfedges pair them; the
report's topology counts vertex pairs (`measures/topology.py`), which are fewer only at non-manifold edges.
"""

import warp as wp

from dmc_cli.mesh.mesh import Mesh

wp.set_module_options({"enable_backward": False})

REGULAR = wp.constant(4)
"""Valence of a regular vertex, if any face is a quad."""

REGULAR_OF_TRIANGLES = 6
"""Valence of a regular vertex in a mesh of triangles only."""

BLOCK = wp.constant(256)
"""Vertices that one thread counts."""


def regular_valence(mesh: Mesh) -> int:
    """Return the valence of a mesh's regular vertices."""
    return REGULAR_OF_TRIANGLES if mesh.triangle_count == mesh.face_count > 0 else int(REGULAR)


def irregular_percent(mesh: Mesh) -> float:
    """Return the share in percent of irregular vertices of a connected mesh; 0 without vertices of a face.

    Raises:
        CallError: The mesh is not connected.
    """
    device, valence = mesh.device, mesh.require_halfedges().valence
    blocks = -(-mesh.vertex_count // int(BLOCK))
    irregular, unused = device.empty(blocks, wp.int64), device.empty(blocks, wp.int64)
    device.launch(count_irregular_kernel, blocks, [valence, regular_valence(mesh)], [irregular, unused])
    used = mesh.vertex_count - int(device.starts(unused)[1])
    return 100.0 * device.starts(irregular)[1] / used if used else 0.0


@wp.kernel
def count_irregular_kernel(
    # In:
    first: wp.int32,
    valence: wp.array(dtype=wp.int32),
    regular: wp.int32,
    # Out:
    irregular_out: wp.array(dtype=wp.int64),
    unused_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the irregular vertices and those of no face. One thread per block of vertices."""
    block = first + wp.tid()
    irregular = wp.int32(0)
    unused = wp.int32(0)
    for v in range(block * BLOCK, wp.min((block + 1) * BLOCK, valence.shape[0])):
        if valence[v] == 0:
            unused += 1
        elif valence[v] != regular:
            irregular += 1
    irregular_out[block] = wp.int64(irregular)
    unused_out[block] = wp.int64(unused)
