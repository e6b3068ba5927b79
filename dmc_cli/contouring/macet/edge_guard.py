"""Draw vertices back towards their edges where triangles are bad.

On their edges, at least 0.4 of them away from nodes, the vertices of a triangle have a shape of 0.37 or more
where cells are cubes. A triangle is bad below 0.4 if it would be better there. Its vertices are drawn back by
thirds of their way, the polygons round them are triangulated anew, and all is looked at again: what is on its
edge stays, so this ends.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.macet.surface_steps import AXIS, Steps, unit
from dmc_cli.contouring.macet.triangle_ranges import has_changed, rows_of_cells
from dmc_cli.contouring.stages.edge_ranks import EdgeBits, EdgeRanks
from dmc_cli.field import Grid, GridShape, slice_distance
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LEAST_SHAPE = wp.constant(0.4)
"""Twice the radius of a triangle's inner circle by that of its outer one, below which it is bad."""

WORTHWHILE = wp.constant(1.0e-3)
"""How much better a bad triangle has to be on the edges."""

FARTHEST = wp.constant(0.1)
"""How far from an edge's middle a vertex that is drawn back lies, at most."""

THIRD = wp.constant(wp.uint8(4))
"""What a vertex's state grows by with each third."""

ON_EDGE = wp.constant(wp.uint8(12))
"""The bits of a state that count the thirds, and what they are on the edge."""

MARK = wp.constant(wp.uint8(128))
"""The bit of a state that says that a triangle of the vertex is bad."""


class EdgeGuard:
    """Finds bad triangles and draws their vertices back, a round at a time.

    Attributes:
        changed: Whether a vertex of each row has moved in the last round, uint8.
    """

    def __init__(
        self, ranks: EdgeRanks, affine: Float64Array, depths: Any, grid: GridShape, device: Device
    ) -> None:
        """Begin with all triangles; `affine`, (4, 4), and `depths` are those of the world."""
        linear = affine[:3, :3] / np.abs(affine[:3, :3]).max()
        self.changed = device.empty(0, wp.uint8)
        self._bad = device.empty(ranks.triangle_count, wp.uint8)
        self._counts = device.empty(grid.rows, wp.int32)
        self._shape = [wp.mat33(*linear.ravel().tolist()), depths]
        self._grid, self._ranks, self._device = grid, ranks, device

    def draws_back(self, faces: Any, steps: Any) -> bool:
        """Judge the triangles that have changed, and draw back the vertices of bad ones, if there are any."""
        device, grid, ranks = self._device, self._grid, self._ranks
        threads, ends = -(-grid.rows // device.span), [grid.rows, device.span]
        inputs = [grid.struct(), ranks.triangle_starts, faces, *self._shape, self.changed, *ends, steps]
        device.launch(judge_kernel, threads, inputs, [self._bad, self._counts], 1)
        if device.total(self._counts) == 0:
            return False
        if not self.changed.shape[0]:
            self.changed = device.empty(grid.rows, wp.uint8)
        inputs = [grid.struct(), ranks.bits, ranks.triangle_starts, faces, self._bad, self._counts, *ends]
        device.launch(draw_back_kernel, threads, inputs, [steps, self.changed], 1)
        return True


@wp.func
def shape_of(turn: wp.mat33, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.float32:
    """Return twice the radius of a triangle's inner circle by that of its outer one; 0 if it has no area."""
    p = wp.length(turn * (b - a))
    q = wp.length(turn * (c - b))
    r = wp.length(turn * (a - c))
    product = p * q * r
    shape = float(0.0)
    if product > 0.0:
        shape = ((p + q) - r) * (((q + r) - p) * ((r + p) - q)) / product
    return shape


@wp.func
def step_on_edge(steps: Steps, v: wp.int32) -> wp.vec3:
    """Return the step to where a vertex lies when it is drawn back all the way."""
    along = wp.clamp(steps.crossing[v] - 0.5, -FARTHEST, FARTHEST)
    return along * unit(wp.int32(steps.state[v] & AXIS))


@wp.func
def position_on_edge(steps: Steps, v: wp.int32) -> wp.vec3:
    """Return where that is, in node indices."""
    return steps.position[v] + (step_on_edge(steps, v) - steps.step[v])


@wp.func
def is_on_edge(steps: Steps, v: wp.int32) -> wp.bool:
    """Return whether a vertex has been drawn back all the way."""
    return (steps.state[v] & ON_EDGE) == ON_EDGE


@wp.func
def is_bad(turn: wp.mat33, steps: Steps, face: wp.vec4i) -> wp.bool:
    """Return whether a triangle is bad, and would be better on its edges."""
    a = face[0]
    b = face[1]
    c = face[2]
    shape = shape_of(turn, steps.position[a], steps.position[b], steps.position[c])
    bad = bool(False)
    if not shape >= LEAST_SHAPE:
        if not (is_on_edge(steps, a) and is_on_edge(steps, b) and is_on_edge(steps, c)):
            on_edge = shape_of(
                turn, position_on_edge(steps, a), position_on_edge(steps, b), position_on_edge(steps, c)
            )
            bad = on_edge > shape + WORTHWHILE
    return bad


@wp.kernel
def judge_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    triangle_starts: wp.array(dtype=wp.int64),
    faces: wp.array(dtype=wp.vec4i),
    linear: wp.mat33,
    depths: wp.array(dtype=wp.float64),
    changed: wp.array(dtype=wp.uint8),
    rows: wp.int32,
    span: wp.int32,
    steps: Steps,
    # In/out:
    bad_inout: wp.array(dtype=wp.uint8),
    counts_inout: wp.array(dtype=wp.int32),
) -> None:
    """Find the bad triangles of some rows, as far as they have changed. One thread per `span` rows."""
    start = (first + wp.tid()) * span
    for row in range(start, wp.min(start + span, rows)):
        low = wp.int32(triangle_starts[row])
        high = wp.int32(triangle_starts[row + 1])
        if low == high:
            counts_inout[row] = 0
        elif has_changed(grid, triangle_starts, changed, row):
            turn = linear
            if depths.shape[0] > 0:
                step = wp.float32(slice_distance(depths, row / grid.ny))
                for n in range(3):
                    turn[n, 2] = step * linear[n, 2]
            count = int(0)
            for t in range(low, high):
                bad = wp.where(is_bad(turn, steps, faces[t]), 1, 0)
                bad_inout[t] = wp.uint8(bad)
                count += bad
            counts_inout[row] = count


@wp.kernel
def draw_back_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    triangle_starts: wp.array(dtype=wp.int64),
    faces: wp.array(dtype=wp.vec4i),
    bad: wp.array(dtype=wp.uint8),
    counts: wp.array(dtype=wp.int32),
    rows: wp.int32,
    span: wp.int32,
    # In/out:
    steps: Steps,
    # Out:
    changed_out: wp.array(dtype=wp.uint8),
) -> None:
    """Draw the vertices of bad triangles back by a third, those of some rows. One thread per `span` rows."""
    start = (first + wp.tid()) * span
    end = wp.min(start + span, rows)
    low = wp.int32(bits.starts[start])
    high = wp.int32(bits.starts[end])
    for part in range(2):
        near = rows_of_cells(grid, start, end, part)
        for row in range(near[0], near[1]):
            if counts[row] > 0:
                for t in range(wp.int32(triangle_starts[row]), wp.int32(triangle_starts[row + 1])):
                    if bad[t] != wp.uint8(0):
                        face = faces[t]
                        for corner in range(3):
                            v = face[corner]
                            if v >= low and v < high:
                                steps.state[v] = steps.state[v] | MARK
    for row in range(start, end):
        has_moved = wp.uint8(0)
        for v in range(wp.int32(bits.starts[row]), wp.int32(bits.starts[row + 1])):
            state = steps.state[v]
            if state >= MARK:
                state = state & ~MARK
                if not (state & ON_EDGE) == ON_EDGE:
                    done = wp.float32((state & ON_EDGE) >> wp.uint8(2))
                    goal = step_on_edge(steps, v)
                    step = steps.step[v]
                    then = goal + ((2.0 - done) / (3.0 - done)) * (step - goal)
                    steps.position[v] = steps.position[v] + (then - step)
                    steps.step[v] = then
                    state += THIRD
                    has_moved = wp.uint8(1)
                steps.state[v] = state
        changed_out[row] = has_moved
