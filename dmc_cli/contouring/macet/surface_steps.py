"""Bring vertices to the surface along the gradient, near the middles of their edges.

Until it is placed a vertex is its edge and a step from the edge's middle, in cells along the grid's axes. It
follows the gradient of the trilinear interpolant by Newton steps of at most a quarter of a cell, first from
the middle, then from half-way to the mean of its neighbours in the tangent plane. A vertex in a face of the
grid stays in it, and one beside a cell that does not exist on its edge. Where the gradient leads nowhere
near, the vertex stays where it was, at first the crossing of its edge. Sixteen go at once, on CUDA one.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import VECTOR_FLAGS, Words
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.field import FARTHEST, Field, Grid, before_line
from dmc_cli.runtime import Device, native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

NEAR, FAR = 0.5, 0.6
"""How far from its edge's middle a vertex may go, in cells: at first, when the crossing is no further away,
and towards its neighbours."""

AXIS = wp.constant(wp.uint8(3))
"""The bits of a vertex's state that hold the axis of its edge."""


@wp.struct
class Steps:
    """Where the vertices on crossed edges are.

    Attributes:
        cell, local, position: As `EdgeVertices` has them: of the crossings, until the vertices are placed. In
            between `position` is in node indices, for the means of neighbours.
        crossing: How far along its edge each crossing lies.
        step: From the edge's middle, in cells.
        state: The axis of the edge, and what `edge_guard` adds to it.
    """

    cell: wp.array(dtype=wp.int64)
    local: wp.array(dtype=wp.vec3)
    crossing: wp.array(dtype=wp.float32)
    step: wp.array(dtype=wp.vec3)
    position: wp.array(dtype=wp.vec3)
    state: wp.array(dtype=wp.uint8)


def make_steps(vertices: Any, count: int, device: Device) -> Any:
    """Return the kernels' `Steps` of so many vertices; steps and states are still to be written."""
    steps = Steps()
    steps.cell, steps.local, steps.crossing = vertices.cell, vertices.local, vertices.crossing
    steps.position = vertices.position
    steps.step = device.empty(count + 1, wp.vec3)
    steps.state = device.empty(count, wp.uint8)
    return steps


@wp.func
def unit(axis: wp.int32) -> wp.vec3:
    """Return the step of one cell along an axis."""
    return wp.vec3(
        wp.where(axis == 0, 1.0, 0.0), wp.where(axis == 1, 1.0, 0.0), wp.where(axis == 2, 1.0, 0.0)
    )


@wp.func_native(native(__file__, "settle_rows"))
def settle_rows(
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    isovalue: wp.float64,
    sign: wp.float64,
    farthest: wp.float64,
    outside: wp.float64,
    at_least: wp.float64,
    has_nodata: wp.int32,
    nodata: wp.float64,
    padding_low: wp.float64,
    padding_high: wp.float64,
    exists: wp.array(dtype=Words),
    is_marked: wp.int32,
    nodes: wp.vec3i,
    border: wp.int32,
    words: wp.int32,
    ahead: wp.int32,
    start: wp.int32,
    end: wp.int32,
    starts: wp.array(dtype=wp.int64),
    along_x: wp.array(dtype=wp.int32),
    along_y: wp.array(dtype=wp.int32),
    to_x: wp.vec4d,
    to_y: wp.vec4d,
    to_z: wp.vec4d,
    crossing: wp.array(dtype=wp.float32),
    reach: wp.float32,
    sums: wp.array(dtype=wp.vec4),
    cell_inout: wp.array(dtype=wp.int64),
    local_inout: wp.array(dtype=wp.vec3),
    step_inout: wp.array(dtype=wp.vec3),
    position_inout: wp.array(dtype=wp.vec3),
    state_out: wp.array(dtype=wp.uint8),
) -> None:
    """Move the vertices on the edges from rows `start` to `end` - 1, at most `reach` cells from the middles.

    With sums of neighbours they go towards these, and are placed; else they go from the middles. `ahead`
    words lie before the lines; `to_x` to `to_z` are rows of the map to the output space.
    """
    ...


@wp.kernel
def settle_rows_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    bits: EdgeBits,
    matrix: wp.mat44d,
    rows: wp.int32,
    span: wp.int32,
    reach: wp.float32,
    sums: wp.array(dtype=wp.vec4),
    # In/out:
    steps: Steps,
) -> None:
    """Move the vertices of some rows. One thread per `span` rows."""
    start = (first + wp.tid()) * span
    end = wp.min(start + span, rows)
    if bits.starts[start] == bits.starts[end]:
        return
    settle_rows(
        field.values,
        field.kind,
        field.isovalue,
        field.sign,
        wp.float64(FARTHEST),
        field.outside,
        field.least,
        field.has_nodata,
        field.nodata,
        field.padding_low,
        field.padding_high,
        bits.exists,
        bits.is_marked,
        wp.vec3i(grid.nx, grid.ny, grid.nz),
        grid.border,
        grid.words,
        before_line(grid),
        start,
        end,
        bits.starts,
        bits.along_x,
        bits.along_y,
        wp.vec4d(matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]),
        wp.vec4d(matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]),
        wp.vec4d(matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]),
        steps.crossing,
        reach,
        sums,
        steps.cell,
        steps.local,
        steps.step,
        steps.position,
        steps.state,
    )
