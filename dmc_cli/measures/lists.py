"""List measures face by face and vertex by vertex, as figures of their spread need them."""

import numpy as np
import warp as wp

from dmc_cli.array_types import Float32Array, Float64Array
from dmc_cli.field import Field, Grid, cell_node, cell_values, trilinear_value
from dmc_cli.measures.elements import face_numbers, mesh_origin
from dmc_cli.measures.quality import point_at
from dmc_cli.measures.shape import quad_shape, triangle_shape
from dmc_cli.measures.verdict import NAMES, NUMBERS, FaceNumbers
from dmc_cli.mesh import Mesh, Placement, require_mesh
from dmc_cli.runtime import ITEMS_A_CHUNK
from dmc_cli.volume import Volume

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def list_elements_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    origin: wp.vec3d,
    # Out:
    numbers_out: wp.array[FaceNumbers],
) -> None:
    """List the numbers of a face. One thread per face."""
    face = first + wp.tid()
    numbers_out[face] = face_numbers(points, corners, face, origin)


@wp.kernel
def list_shapes_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    origin: wp.vec3d,
    # Out:
    shapes_out: wp.array[wp.float32],
) -> None:
    """List the shape of a quad, the mean ratio of a triangle. One thread per face."""
    face = first + wp.tid()
    a = point_at(points, corners[4 * face], origin)
    b = point_at(points, corners[4 * face + 1], origin)
    c = point_at(points, corners[4 * face + 2], origin)
    if corners[4 * face + 3] < 0:
        shapes_out[face] = wp.float32(triangle_shape(a, b, c).ratio)
    else:
        d = point_at(points, corners[4 * face + 3], origin)
        shapes_out[face] = wp.float32(quad_shape(a, b, c, d).quality)


@wp.kernel
def list_deviation_kernel(
    first: wp.int32,
    # In:
    field: Field,
    grid: Grid,
    cells: wp.array[wp.int64],
    local: wp.array[wp.vec3f],
    # Out:
    deviations_out: wp.array[wp.float64],
) -> None:
    """List the deviation of a vertex, in stored values. One thread per vertex."""
    vertex = first + wp.tid()
    node = cell_node(grid, cells[vertex])
    f = cell_values(field, grid, node[0], node[1], node[2])
    p = local[vertex]
    u = wp.float64(p[0])
    v = wp.float64(p[1])
    w = wp.float64(p[2])
    deviations_out[vertex] = wp.abs(trilinear_value(f, u, v, w))


def list_elements(mesh: Mesh) -> dict[str, Float64Array]:
    """Return the measures of each face by name, (F,) or (F, 2) float64; NaN where a triangle has none.

    Names: shape (equation 9 of the paper of 2021), scaled_jacobian, aspect_ratio, skew, taper, stretch,
    warpage, min_angle and max_angle (degrees); mean_ratio and radius_ratio of both triangles of the split.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    require_mesh(mesh)
    numbers = mesh.device.empty(mesh.face_count, FaceNumbers)
    inputs = [mesh.positions, mesh.corners, mesh_origin(mesh)]
    mesh.device.launch(list_elements_kernel, mesh.face_count, inputs, [numbers], ITEMS_A_CHUNK)
    table = numbers.numpy().reshape(-1, NUMBERS)
    found = {name: table[:, n] for n, name in enumerate(NAMES)}
    for name in ("mean_ratio", "radius_ratio"):
        found[name] = np.stack([found[name], found.pop(f"{name}_of_second")], axis=1)
    return found


def list_shapes(mesh: Mesh) -> Float32Array:
    """Return one number for the shape of each face, (F,) float32: 1 at best, 0 without area.

    Of a quad it is equation 9 of the paper of 2021, of a triangle equation 8.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    require_mesh(mesh)
    shapes = mesh.device.empty(mesh.face_count, wp.float32)
    inputs = [mesh.positions, mesh.corners, mesh_origin(mesh)]
    mesh.device.launch(list_shapes_kernel, mesh.face_count, inputs, [shapes], ITEMS_A_CHUNK)
    found: Float32Array = shapes.numpy()
    return found


def list_deviation(placement: Placement, volume: Volume) -> Float64Array:
    """Return the deviation of each vertex in physical values (equation 7), (V,) float64; NaN beside no data.

    Args:
        placement: Where they lie.
        volume: The volume, for its slope.
    """
    frame, count = placement.frame, placement.cell.shape[0]
    deviations = frame.device.empty(count, wp.float64)
    inputs = [frame.field, frame.grid.struct(), placement.cell, placement.local]
    frame.device.launch(list_deviation_kernel, count, inputs, [deviations], ITEMS_A_CHUNK)
    found: Float64Array = abs(volume.slope) * deviations.numpy()
    return found
