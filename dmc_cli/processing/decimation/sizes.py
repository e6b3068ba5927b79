"""Rate how large quads are where they stand, so that those among small ones go first.

Of equal quads a surface has the least error that so many can have, where it is as curved everywhere: the
error grows with the square of the sides. Cost alone, which is mostly regularity, leaves quads of half the
mean area here and of twice that there.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.mesh import WorkingMesh
from dmc_cli.processing.quad_square import quad_area

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SPREAD = 2
"""Times that areas are averaged with those across the sides: to say what is round about a quad, and no single
quad's shape."""

POWER = wp.constant(20.0)
"""Of the mean area that a cost grows with: a tenth more makes up for a unit of irregularity."""

MOST_RATIO = wp.constant(5.0)
"""Of areas to their mean: larger ones, and smaller ones than its inverse, are not told from others."""


def size_weights(mesh: WorkingMesh) -> Any:
    """Return what a collapse costs more where quads are large, float32 (Q,): 1 where they are as the mean."""
    device, quads = mesh.device, mesh.face_count
    area, other = device.empty(quads, wp.float32), device.empty(quads, wp.float32)
    device.launch(measure_areas_kernel, quads, [mesh.arrays.corners, mesh.arrays.position], [area])
    mean = float(area.numpy().mean(dtype=np.float64))
    for _time in range(SPREAD):
        device.launch(average_kernel, quads, [mesh.arrays.twin, area], [other])
        area, other = other, area
    device.launch(weigh_kernel, quads, [area, mean], [other])
    return other


@wp.kernel
def measure_areas_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    # Out:
    area_out: wp.array(dtype=wp.float32),
) -> None:
    """Find the area of each quad. One thread a quad."""
    q = first + wp.tid()
    area_out[q] = 0.5 * wp.length(quad_area(corners, position, q))


@wp.kernel
def average_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    area: wp.array(dtype=wp.float32),
    # Out:
    area_out: wp.array(dtype=wp.float32),
) -> None:
    """Find the mean of each quad's area and those across its sides. One thread a quad."""
    q = first + wp.tid()
    total = area[q]
    count = float(1.0)
    for c in range(4):
        t = twin[4 * q + c]
        if t >= 0:
            total += area[t >> 2]
            count += 1.0
    area_out[q] = total / count


@wp.kernel
def weigh_kernel(
    # In:
    first: wp.int32,
    area: wp.array(dtype=wp.float32),
    mean: wp.float32,
    # Out:
    weight_out: wp.array(dtype=wp.float32),
) -> None:
    """Raise each area, against the mean, to a power. One thread a quad."""
    q = first + wp.tid()
    weight_out[q] = wp.pow(wp.clamp(area[q] / wp.max(mean, 1.0e-30), 1.0 / MOST_RATIO, MOST_RATIO), POWER)
