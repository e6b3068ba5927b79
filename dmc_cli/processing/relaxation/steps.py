"""Smooth on the surface (`--relax N`): vertices glide to where their quads have better shapes.

Each quad names the square nearest to its corners; a vertex goes towards the mean of the corners that its
quads' squares offer it, along the surface's tangent plane only, and is put back on the trilinear surface.
So sizes stay what the surface's grid made them, and angles and sides become equal.

All vertices move at once (Jacobi). A step is checked quad by quad: no quad may become worse in shape than
the worst of the old quads round its vertices, turn a corner against the surface, fold onto one across a side,
or come to be warped by more than a solver takes. The vertices of a quad
that fails halve their step, and after `HALVINGS` of these stay; then all is checked again. Staying is what
the mesh was before, so this ends, and the least shape of the mesh never falls. A step that does not raise
the mean shape is not taken, and is the last one: long quads between thick slices cannot become squares.

Vertices on a boundary, with several fans of quads, or where no point of the surface is found stay put.
Shape is equation 9 of Grosso & Zint 2021, negative at a corner that turns against its quad.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.field import cell_node, node_cell, output_position
from dmc_cli.mesh import (
    Mesh,
    MeshArrays,
    Placement,
    connect,
    in_frame_of,
    in_near_frame,
    mesh_arrays,
    next_outgoing,
    quad_corner,
    require_places,
    require_quads,
    ring_size,
)
from dmc_cli.processing.distance_guard import TrackedPoints, keep_points_near
from dmc_cli.processing.quad_square import nearest_square_corner, quad_shape
from dmc_cli.processing.relaxation.step_checks import NO_SLIVER, SLIVER, Spots, check_kernel
from dmc_cli.processing.tangent_step import SurfaceContext, glide, make_context, surface_normal
from dmc_cli.progress import SILENT, Progress
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

HALVINGS = 2
"""A vertex tries its step, a half and a quarter of it, then stays."""

UNTRIED, FIXED = wp.constant(-1), wp.constant(-2)
STAYS = wp.constant(HALVINGS + 1)
"""What a vertex's level says beside its halvings: not moved yet, on a boundary, to move no more."""

HALVING_CHECKS = 4
"""Checks after which the vertices of a failing quad stay without trying a smaller step first."""

OVERRELAXATION = wp.constant(1.3)
"""Share of the way to the goal that a step takes: more than all of it, since the neighbours move as well."""

WEIGHT_OF_SHAPE = wp.constant(3.0)
"""How much more a quad of shape 0 counts than a square: the worst improve first."""


def relax(
    mesh: Mesh,
    placement: Placement,
    steps: int,
    progress: Progress = SILENT,
    tracked: TrackedPoints | None = None,
) -> tuple[Mesh, Placement]:
    """Return the mesh after at most `steps` steps of its vertices to better shapes; no array is changed.

    Args:
        mesh: A mesh of quads.
        placement: Where its vertices lie.
        steps: How many; fewer where the mean shape rises no more.
        progress: Told the share of the steps that are done.
        tracked: Points that must not be left behind.

    Raises:
        SettingsError: The mesh has triangles.
        CallError: Mesh and placement do not belong together.
    """
    mesh = connect(require_quads(mesh, "--relax"))
    require_places(mesh, placement)
    affine = placement.frame.affine
    mesh, placement = in_near_frame(mesh, placement)
    device, count, frame = mesh.device, mesh.vertex_count, placement.frame
    arrays, context = mesh_arrays(mesh), make_context(frame)
    normal = find_normals(context, placement.cell, placement.local, device)
    now = _spots(mesh.positions, placement.cell, placement.local, normal)
    spare = [_empty_spots(count, device) for _ in range(min(steps, 2))]
    scratch = _Scratch.of(count, mesh.face_count, device)
    total_shape = _measure(arrays, now, scratch, device)
    for step in range(steps):
        progress.advance(step / steps)
        then = spare.pop()
        _take_step(arrays, context, frame.sense, now, then, scratch, tracked, device)
        before, total_shape = total_shape, _measure(arrays, then, scratch, device)
        if not total_shape > before:
            break
        if step:
            spare.append(now)
        now = then
    mesh = replace(mesh, positions=now.position)
    return in_frame_of(affine, mesh, replace(placement, cell=now.cell, local=now.local))


def measure_shapes(mesh: Mesh) -> Any:
    """Return the shapes of the quads of a connected mesh, float32 (Q,)."""
    shape = mesh.device.empty(mesh.face_count, wp.float32)
    mesh.device.launch(measure_shapes_kernel, mesh.face_count, [mesh.corners, mesh.positions], [shape])
    return shape


@dataclass(frozen=True)
class _Scratch:
    """Arrays that every step writes anew: of quads shape and failing, of vertices the others."""

    shape: Any
    failing: Any
    floor: Any
    aim: Any
    level: Any
    has_moved: Any
    must_retreat: Any

    @staticmethod
    def of(vertex_count: int, quad_count: int, device: Device) -> "_Scratch":
        """Return room for a mesh."""
        return _Scratch(
            shape=device.empty(quad_count, wp.float32),
            failing=device.empty(quad_count, wp.uint8),
            floor=device.empty(vertex_count, wp.float32),
            aim=device.empty(vertex_count, wp.vec3),
            level=device.empty(vertex_count, wp.int8),
            has_moved=device.empty(vertex_count, wp.uint8),
            must_retreat=device.zeros(vertex_count, wp.uint8),
        )


def _measure(mesh: Any, spots: Any, scratch: _Scratch, device: Device) -> float:
    """Measure the quads and return the sum of their shapes."""
    device.launch(
        measure_shapes_kernel, scratch.shape.shape[0], [mesh.corners, spots.position], [scratch.shape]
    )
    return float(scratch.shape.numpy().sum(dtype=np.float64))


def _take_step(
    mesh: Any,
    context: Any,
    sense: float,
    now: Any,
    then: Any,
    scratch: _Scratch,
    tracked: TrackedPoints | None,
    device: Device,
) -> None:
    """Move the vertices from `now`, whose shapes are measured, to `then`, as far as no quad suffers."""
    vertex_count, quad_count = scratch.level.shape[0], scratch.shape.shape[0]
    outputs = [scratch.floor, scratch.aim, scratch.level]
    device.launch(aim_kernel, vertex_count, [mesh, scratch.shape, now], outputs)
    is_failing, checks = True, 0
    while is_failing:
        inputs = [context, now, scratch.aim, int(checks < HALVING_CHECKS)]
        outputs = [scratch.level, scratch.must_retreat, scratch.has_moved, then]
        device.launch(move_kernel, vertex_count, inputs, outputs)
        sliver = NO_SLIVER if tracked is None else SLIVER
        inputs = [context, mesh, sense, now, then, scratch.shape, scratch.floor, int(tracked is not None)]
        inputs += [sliver, scratch.has_moved]
        device.launch(check_kernel, quad_count, inputs, [scratch.must_retreat, scratch.failing])
        if tracked is not None:
            flags = (scratch.has_moved, scratch.must_retreat, scratch.failing)
            keep_points_near(tracked, context.grid, mesh.corners, then, flags, device)
        is_failing, checks = device.total(scratch.failing) > 0, checks + 1


def find_normals(context: Any, cell: Any, local: Any, device: Device) -> Any:
    """Return the surface's unit normals at vertices, along the gradient, vec3 (V,)."""
    normal = device.empty(cell.shape[0], wp.vec3)
    device.launch(find_normals_kernel, cell.shape[0], [context, cell, local], [normal])
    return normal


def _spots(position: Any, cell: Any, local: Any, normal: Any) -> Any:
    """Return the kernels' view of vertices."""
    spots = Spots()
    spots.position, spots.cell, spots.local, spots.normal = position, cell, local, normal
    return spots


def _empty_spots(count: int, device: Device) -> Any:
    """Return the kernels' view of vertices that are still to be written."""
    position, local, normal = (device.empty(count, wp.vec3) for _ in range(3))
    return _spots(position, device.empty(count, wp.int64), local, normal)


@wp.kernel
def find_normals_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    # Out:
    normal_out: wp.array(dtype=wp.vec3),
) -> None:
    """Find the surface's normal at each vertex. One thread per vertex."""
    v = first + wp.tid()
    normal_out[v] = surface_normal(context, cell_node(context.grid, cell[v]), local[v])


@wp.kernel
def measure_shapes_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    # Out:
    shape_out: wp.array(dtype=wp.float32),
) -> None:
    """Measure the quads. One thread per quad."""
    q = first + wp.tid()
    h = 4 * q
    a = position[quad_corner(corners, h, 0)]
    b = position[quad_corner(corners, h, 1)]
    c = position[quad_corner(corners, h, 2)]
    d = position[quad_corner(corners, h, 3)]
    shape_out[q] = quad_shape(a, b, c, d)


@wp.kernel
def aim_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    shape: wp.array(dtype=wp.float32),
    spots: Spots,
    # Out:
    floor_out: wp.array(dtype=wp.float32),
    aim_out: wp.array(dtype=wp.vec3),
    level_out: wp.array(dtype=wp.int8),
) -> None:
    """Find each vertex's worst quad, and its step towards its squares' corners. One thread per vertex."""
    v = first + wp.tid()
    h = mesh.vertex_halfedge[v]
    size = ring_size(mesh.twin, h, mesh.valence[v])
    floor = float(1.0)
    goal = wp.vec3(0.0, 0.0, 0.0)
    weights = float(0.0)
    for _quad in range(size):
        a = spots.position[quad_corner(mesh.corners, h, 0)]
        b = spots.position[quad_corner(mesh.corners, h, 1)]
        c = spots.position[quad_corner(mesh.corners, h, 2)]
        d = spots.position[quad_corner(mesh.corners, h, 3)]
        weight = 1.0 + WEIGHT_OF_SHAPE * (1.0 - shape[h >> 2])
        goal += weight * nearest_square_corner(a, b, c, d)
        weights += weight
        floor = wp.min(floor, shape[h >> 2])
        h = next_outgoing(mesh.twin, h)
    aim = wp.vec3(0.0, 0.0, 0.0)
    level = wp.int8(FIXED)
    if size > 0:
        aim = OVERRELAXATION * (goal / weights - spots.position[v])
        aim -= wp.dot(aim, spots.normal[v]) * spots.normal[v]
        level = wp.int8(UNTRIED)
    floor_out[v] = floor
    aim_out[v] = aim
    level_out[v] = level


@wp.kernel
def move_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    now: Spots,
    aim: wp.array(dtype=wp.vec3),
    may_halve: wp.int32,
    # In/out:
    level_inout: wp.array(dtype=wp.int8),
    must_retreat_inout: wp.array(dtype=wp.uint8),
    # Out:
    has_moved_out: wp.array(dtype=wp.uint8),
    then: Spots,
) -> None:
    """Move vertices of failing quads by their next smaller step, at last by none. One thread per vertex."""
    v = first + wp.tid()
    level = level_inout[v]
    has_moved_out[v] = wp.uint8(0)
    if level == wp.int8(UNTRIED):
        level = wp.int8(0)
    elif level == wp.int8(FIXED):
        level = wp.int8(STAYS)
    elif level == wp.int8(STAYS) or must_retreat_inout[v] == wp.uint8(0):
        return
    else:
        level = wp.int8(wp.where(may_halve == 1, wp.int32(level) + 1, STAYS))
    position = now.position[v]
    cell = now.cell[v]
    local = now.local[v]
    normal = now.normal[v]
    if level < wp.int8(STAYS):
        end = glide(context, cell, local, wp.pow(0.5, wp.float32(level)) * aim[v])
        facing = wp.vec3(0.0, 0.0, 0.0)
        if end.is_found:
            facing = surface_normal(context, end.cell, end.local)
        if wp.dot(facing, normal) > 0.0:
            position = output_position(context.to_output, context.depths, end.cell, end.local)
            cell = node_cell(context.grid, end.cell)
            local = end.local
            normal = facing
        else:
            level = wp.int8(STAYS)
    level_inout[v] = level
    must_retreat_inout[v] = wp.uint8(0)
    has_moved_out[v] = wp.uint8(1)
    then.position[v] = position
    then.cell[v] = cell
    then.local[v] = local
    then.normal[v] = normal
