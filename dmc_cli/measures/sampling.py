"""Spread points over a mesh: as many on each part as its area asks for, always the same ones.

The number of points up to each face is the area up to it by the density, rounded, so that no area differs
from its share by more than one point. Where a point lies on its face follows from its number by a sequence of
low discrepancy (Roberts 2018, R2: multiples of powers of the plastic number), mapped to the face's two
triangles so that area is kept.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.errors import SettingsError
from dmc_cli.measures.split_faces import double_point, face_points, split_faces
from dmc_cli.mesh import Mesh
from dmc_cli.runtime import ITEMS_A_CHUNK, mesh_size

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

MOST_SAMPLES = 1_000_000_000
"""Samples that may be asked for."""

STEP_U = wp.constant(wp.float64(0.7548776662466927))
STEP_V = wp.constant(wp.float64(0.5698402909980532))
HALF = wp.constant(wp.float64(0.5))
ONE = wp.constant(wp.float64(1.0))


@wp.func
def area_of(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.float64:
    """Return the area of a triangle."""
    return HALF * wp.length(wp.cross(b - a, c - a))


@wp.kernel
def measure_areas_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    # Out:
    areas_out: wp.array[wp.float64],
) -> None:
    """Measure the area of a face. One thread per face."""
    f = first + wp.tid()
    face = face_points(points, corners, turns, f)
    a = double_point(face[0])
    c = double_point(face[2])
    areas_out[f] = area_of(a, double_point(face[1]), c) + area_of(a, c, double_point(face[3]))


@wp.kernel
def sample_faces_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    ends: wp.array[wp.int64],
    # Out:
    samples_out: wp.array[wp.vec3d],
) -> None:
    """Place a sample on the face whose samples its number is among. One thread per sample."""
    n = first + wp.tid()
    f = wp.lower_bound(ends, wp.int64(n) + wp.int64(1))
    face = face_points(points, corners, turns, f)
    a = double_point(face[0])
    b = double_point(face[1])
    c = double_point(face[2])
    d = double_point(face[3])
    u = HALF + wp.float64(n) * STEP_U
    v = HALF + wp.float64(n) * STEP_V
    u = u - wp.floor(u)
    v = v - wp.floor(v)
    first_area = area_of(a, b, c)
    second_area = area_of(a, c, d)
    share = first_area / (first_area + second_area)
    if u < share:
        u = u / share
    else:
        u = wp.min((u - share) / (ONE - share), ONE)
        b = c
        c = d
    root = wp.sqrt(u)
    samples_out[n] = a + root * (b - a) + root * v * (c - b)


def sample_surface(mesh: Mesh, density: float) -> Any:
    """Return points spread over a mesh, vec3d (N,) on its device: `density` of them on a unit of area.

    Raises:
        SettingsError: There would be too many.
    """
    device, turns = mesh.device, split_faces(mesh)
    ends = np.floor(np.cumsum(_face_areas(mesh, turns)) * density + 0.5)
    if len(ends) and not ends[-1] <= MOST_SAMPLES:
        raise SettingsError(
            f"density is {density:g}, which makes {ends[-1]:.3g} samples; expected at most {MOST_SAMPLES}"
        )
    count = mesh_size(int(ends[-1])) if len(ends) else 0
    samples = device.empty(count, wp.vec3d)
    listed = wp.array(ends.astype(np.int64), dtype=wp.int64, device=device.name)
    inputs = [mesh.positions, mesh.corners, turns, listed]
    device.launch(sample_faces_kernel, count, inputs, [samples], ITEMS_A_CHUNK)
    return samples


def _face_areas(mesh: Mesh, turns: Any) -> Any:
    """Return the area of each face, (F,) float64."""
    areas = mesh.device.empty(mesh.face_count, wp.float64)
    inputs = [mesh.positions, mesh.corners, turns]
    mesh.device.launch(measure_areas_kernel, mesh.face_count, inputs, [areas], ITEMS_A_CHUNK)
    return areas.numpy()
