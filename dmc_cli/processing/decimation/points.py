"""Find the nearest quads of tracked points, and the mean side of the quads."""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.mesh import WorkingMesh
from dmc_cli.processing.decimation.guard import nearest_round
from dmc_cli.processing.distance_guard import TrackedPoints

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


def nearest_quads(tracked: TrackedPoints, place: Any, mesh: WorkingMesh) -> Any:
    """Return the nearest of each point's quad and those round its corners, int32 (G,)."""
    arrays, device = mesh.arrays, mesh.device
    nearest = device.empty(tracked.count, wp.int32)
    inputs = [arrays.corners, arrays.twin, arrays.position, place, tracked.nearest_quad]
    device.launch(find_nearest_kernel, tracked.count, inputs, [nearest])
    return nearest


def mean_side(mesh: WorkingMesh) -> float:
    """Return the mean length of the quads' sides, 0 of none."""
    if not mesh.face_count:
        return 0.0
    sides = mesh.device.empty(mesh.face_count, wp.float32)
    mesh.device.launch(
        measure_sides_kernel, mesh.face_count, [mesh.arrays.corners, mesh.arrays.position], [sides]
    )
    return float(sides.numpy().mean(dtype=np.float64))


@wp.kernel
def measure_sides_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    # Out:
    side_out: wp.array(dtype=wp.float32),
) -> None:
    """Find the mean length of each quad's sides. One thread a quad."""
    q = first + wp.tid()
    total = float(0.0)
    before = position[corners[4 * q + 3]]
    for c in range(4):
        here = position[corners[4 * q + c]]
        total += wp.length(here - before)
        before = here
    side_out[q] = 0.25 * total


@wp.kernel
def find_nearest_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    place: wp.array(dtype=wp.vec3),
    nearest_quad: wp.array(dtype=wp.int32),
    # Out:
    nearest_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the nearest of a point's quad, those across its sides and beside these. One thread per point."""
    g = first + wp.tid()
    best = nearest_quad[g]
    if best >= 0:
        best = nearest_round(corners, twin, position, best, place[g])
    nearest_out[g] = best
