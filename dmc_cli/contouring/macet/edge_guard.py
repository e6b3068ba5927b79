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
from dmc_cli.contouring.macet.placement import index_of, move_vertex
from dmc_cli.contouring.macet.surface_steps import AXIS, Steps, unit
from dmc_cli.contouring.macet.triangle_ranges import rows_of_cells
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.contouring.stages.edge_surface import EdgeStages
from dmc_cli.field import Field, Grid, slice_distance

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

ROWS_A_CHUNK = 16
"""Rows a chunk at least."""

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
        drawn: How many vertices have been drawn back.
    """

    def __init__(self, stages: EdgeStages, affine: Float64Array) -> None:
        """Begin with vertices that are placed; triangles are judged by `affine`, (4, 4)."""
        linear = affine[:3, :3] / np.abs(affine[:3, :3]).max()
        self._shape = [wp.mat33(*linear.ravel().tolist()), stages.true_depths]
        self._bad = stages.device.empty(stages.ranks.triangle_count, wp.uint8)
        self._stages, self._device = stages, stages.device
        below = stages.grid.ny
        self._corners = np.array([0, 1, below, below + 1], np.int32)
        self.drawn = 0

    def draw_back(self, faces: Any, steps: Any, poor: Any) -> Any:
        """Draw back the vertices of bad triangles by a third; return the rows of cells beside them, int32.

        Args:
            faces: The triangles, int32 vec4 (T,).
            steps: The kernels' `Steps`.
            poor: Which rows of cells have poor triangles, uint8 (rows,).
        """
        stages, device, ranks = self._stages, self._device, self._stages.ranks
        grid = stages.grid.struct()
        device.finish()
        rows = np.flatnonzero(poor.numpy()).astype(np.int32)
        if not rows.size:
            return device.empty(0, wp.int32)
        listed = wp.array(rows, device=device.name)
        inputs = [grid, ranks.triangle_starts, faces, *self._shape, listed, steps]
        device.launch(judge_kernel, rows.size, inputs, [self._bad, poor], ROWS_A_CHUNK)
        rows = rows[poor.numpy()[rows] != 0]
        nodes = np.unique(rows[:, None] + self._corners)
        listed, drawn = wp.array(nodes, device=device.name), device.empty(nodes.size, wp.int32)
        inputs = [
            grid,
            stages.field,
            ranks.bits,
            stages.matrix,
            ranks.triangle_starts,
            faces,
            self._bad,
            poor,
        ]
        device.launch(draw_back_kernel, nodes.size, [*inputs, listed], [steps, drawn], ROWS_A_CHUNK)
        counts = drawn.numpy()
        self.drawn += int(np.maximum(counts, 0).sum())
        beside = np.unique(nodes[counts >= 0][:, None] - self._corners)
        return wp.array(beside[beside >= 0], device=device.name)


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
def index_on_edge(grid: Grid, steps: Steps, v: wp.int32) -> wp.vec3:
    """Return where that is, in node indices."""
    return index_of(grid, steps, v) + (step_on_edge(steps, v) - steps.step[v])


@wp.func
def is_on_edge(steps: Steps, v: wp.int32) -> wp.bool:
    """Return whether a vertex has been drawn back all the way."""
    return (steps.state[v] & ON_EDGE) == ON_EDGE


@wp.func
def is_bad(grid: Grid, turn: wp.mat33, steps: Steps, face: wp.vec4i) -> wp.bool:
    """Return whether a triangle is bad, and would be better on its edges."""
    a = face[0]
    b = face[1]
    c = face[2]
    shape = shape_of(turn, index_of(grid, steps, a), index_of(grid, steps, b), index_of(grid, steps, c))
    bad = bool(False)
    if not shape >= LEAST_SHAPE:
        if not (is_on_edge(steps, a) and is_on_edge(steps, b) and is_on_edge(steps, c)):
            on_edge = shape_of(
                turn,
                index_on_edge(grid, steps, a),
                index_on_edge(grid, steps, b),
                index_on_edge(grid, steps, c),
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
    listed: wp.array(dtype=wp.int32),
    steps: Steps,
    # Out:
    bad_out: wp.array(dtype=wp.uint8),
    poor_out: wp.array(dtype=wp.uint8),
) -> None:
    """Find the bad triangles of a row, and tell whether there are any. One thread per listed row."""
    row = listed[first + wp.tid()]
    turn = linear
    if depths.shape[0] > 0:
        step = wp.float32(slice_distance(depths, row / grid.ny))
        for n in range(3):
            turn[n, 2] = step * linear[n, 2]
    some = wp.uint8(0)
    for t in range(wp.int32(triangle_starts[row]), wp.int32(triangle_starts[row + 1])):
        bad = wp.where(is_bad(grid, turn, steps, faces[t]), wp.uint8(1), wp.uint8(0))
        bad_out[t] = bad
        some |= bad
    poor_out[row] = some


@wp.func
def mark_vertices(
    grid: Grid,
    triangle_starts: wp.array(dtype=wp.int64),
    faces: wp.array(dtype=wp.vec4i),
    bad: wp.array(dtype=wp.uint8),
    poor: wp.array(dtype=wp.uint8),
    row: wp.int32,
    low: wp.int32,
    high: wp.int32,
    steps: Steps,
) -> wp.int32:
    """Mark the vertices `low` to `high` - 1 of a row that bad triangles have, and return 0."""
    for part in range(2):
        near = rows_of_cells(grid, row, row + 1, part)
        for r in range(near[0], near[1]):
            if poor[r] != wp.uint8(0):
                for t in range(wp.int32(triangle_starts[r]), wp.int32(triangle_starts[r + 1])):
                    if bad[t] != wp.uint8(0):
                        face = faces[t]
                        for corner in range(3):
                            v = face[corner]
                            if v >= low and v < high:
                                steps.state[v] = steps.state[v] | MARK
    return 0


@wp.kernel
def draw_back_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    bits: EdgeBits,
    matrix: wp.mat44d,
    triangle_starts: wp.array(dtype=wp.int64),
    faces: wp.array(dtype=wp.vec4i),
    bad: wp.array(dtype=wp.uint8),
    poor: wp.array(dtype=wp.uint8),
    listed: wp.array(dtype=wp.int32),
    # In/out:
    steps: Steps,
    # Out:
    drawn_out: wp.array(dtype=wp.int32),
) -> None:
    """Draw the vertices of bad triangles back by a third, those of a row; one thread per listed row.

    `drawn_out` counts those that were not drawn back before; it is -1 where no vertex has moved.
    """
    n = first + wp.tid()
    row = listed[n]
    low = wp.int32(bits.starts[row])
    high = wp.int32(bits.starts[row + 1])
    mark_vertices(grid, triangle_starts, faces, bad, poor, row, low, high, steps)
    drawn = int(-1)
    for v in range(low, high):
        state = steps.state[v]
        if state >= MARK:
            state = state & ~MARK
            steps.state[v] = state
            if not is_on_edge(steps, v):
                done = wp.float32((state & ON_EDGE) >> wp.uint8(2))
                goal = step_on_edge(steps, v)
                step = steps.step[v]
                move_vertex(
                    field, grid, bits, matrix, steps, v, goal + ((2.0 - done) / (3.0 - done)) * (step - goal)
                )
                steps.state[v] = state + THIRD
                drawn = wp.max(drawn, 0) + wp.where((state & ON_EDGE) == wp.uint8(0), 1, 0)
    drawn_out[n] = drawn
