"""Open and close a set of nodes by balls: what is too thin for a ball goes, what no ball gets into is filled.

A ball has its radius in millimetres, so along each axis it reaches as many nodes as the spacing allows; a
node is in it if its centre is. The volume's ends limit no ball: what lies beyond counts for the side that is
asked.

A row of a dilated set is what its neighbours' rows give: those of one half-width together, and from the
greatest half-width down each step widens what there is by a node either way.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Int32Array
from dmc_cli.bits import VECTOR_FLAGS, low_bits, next_node, previous_node
from dmc_cli.errors import SettingsError
from dmc_cli.field import Grid, GridShape
from dmc_cli.runtime import Device, native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

ROUNDING = 1e-9
"""Share of a spacing that a node's distance may be beyond the radius."""

FINE = 4
"""Nodes of a small ball's radius that a large one is made of, at least."""

ROWS_A_CHUNK = 16
"""Rows a chunk at least, as `ITEMS_A_CHUNK` of the device."""


@dataclass(frozen=True)
class Ball:
    """The nodes of a ball round a node, row by row.

    Attributes:
        steps: Steps along y and z to each row, int32 (n, 2), those of the smallest half-width first.
        starts: Where the rows of each half-width begin, and their number as a last item, int32 (widest + 2,).
        times: How often nodes are covered by it one after another, as by one ball so many times larger.
    """

    steps: Int32Array
    starts: Int32Array
    times: int = 1

    @property
    def widest(self) -> int:
        """Return the greatest half-width along x."""
        return len(self.starts) - 2

    @property
    def is_node(self) -> bool:
        """Return whether there is no other node in it."""
        return len(self.steps) == 1 and self.widest == 0


def ball_of(radius: float, spacing: tuple[float, float, float], option: str) -> Ball:
    """Return the nodes within a radius in mm.

    Raises:
        SettingsError: It reaches no other node, so that nothing would change.
    """
    x, y, z = spacing
    ry, rz = (int(radius / step + ROUNDING) for step in (y, z))
    dz, dy = np.meshgrid(np.arange(-rz, rz + 1), np.arange(-ry, ry + 1), indexing="ij")
    left = radius**2 * (1 + ROUNDING) - (dy * y) ** 2 - (dz * z) ** 2
    there = left >= 0
    half = (np.sqrt(left[there]) / x + ROUNDING).astype(np.int32)
    order = np.argsort(half, kind="stable")
    steps = np.stack([dy[there], dz[there]], axis=1).astype(np.int32)[order]
    starts = np.searchsorted(half[order], np.arange(int(half.max()) + 2)).astype(np.int32)
    ball = Ball(steps, starts)
    if ball.is_node:
        raise SettingsError(
            f"{option} is {2 * radius:g} mm, which is less than two nodes are apart; expected at least"
            f" {2 * min(spacing):g} mm; choose more, or leave it out"
        )
    return ball


def large_ball_of(radius: float, spacing: tuple[float, float, float], option: str) -> Ball:
    """Return nearly the nodes within a radius in mm: balls that take less time; errors as `ball_of`."""
    times = max(1, int(radius / (FINE * max(spacing))))
    return replace(ball_of(radius / times, spacing, option), times=times)


def opened(bits: Any, ball: Ball, grid: GridShape, device: Device) -> Any:
    """Return the nodes of a set that some ball inside it covers, uint32 [row, word]."""
    return dilated(
        _rest(dilated(_rest(bits, grid, device), ball, grid, device), grid, device), ball, grid, device
    )


def closed(bits: Any, ball: Ball, grid: GridShape, device: Device) -> Any:
    """Return the nodes that no ball outside a set covers, those of the set among them, uint32 [row, word]."""
    return _rest(opened(_rest(bits, grid, device), ball, grid, device), grid, device)


def dilated(bits: Any, ball: Ball, grid: GridShape, device: Device) -> Any:
    """Return the nodes that a ball round a node of a set covers, uint32 [row, word]."""
    steps = wp.array(ball.steps, dtype=wp.vec2i, device=device.name)
    starts = wp.array(ball.starts, dtype=wp.int32, device=device.name)
    for _ in range(ball.times):
        out = device.empty((grid.rows, grid.words), wp.uint32)
        device.launch(dilate_kernel, grid.rows, [grid.struct(), bits, steps, starts], [out], ROWS_A_CHUNK)
        bits = out
    return bits


def _rest(bits: Any, grid: GridShape, device: Device) -> Any:
    """Return the nodes that are not in a set, uint32 [row, word]."""
    out = device.empty((grid.rows, grid.words), wp.uint32)
    device.launch(complement_kernel, grid.rows, [grid.struct(), bits], [out])
    return out


@wp.kernel
def complement_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: wp.array2d(dtype=wp.uint32),
    # Out:
    out: wp.array2d(dtype=wp.uint32),
) -> None:
    """Set the bits that are not set. One thread a row."""
    row = first + wp.tid()
    for w in range(grid.words):
        out[row, w] = ~bits[row, w] & low_bits(grid.nx - 32 * w)


@wp.func_native(native(__file__, "add_rows"))
def add_rows(
    bits: wp.array2d(dtype=wp.uint32),
    steps: wp.array(dtype=wp.vec2i),
    first: wp.int32,
    last: wp.int32,
    row: wp.int32,
    ny: wp.int32,
    out: wp.array2d(dtype=wp.uint32),
) -> None:
    """Set in a row of `out` the bits of the rows that steps from `first` to before `last` lead to."""
    ...


@wp.func
def widen_row(grid: Grid, row: wp.int32, out: wp.array2d(dtype=wp.uint32)) -> None:
    """Set the bits beside those of a row that are set."""
    before = wp.uint32(0)
    for w in range(grid.words):
        word = out[row, w]
        after = wp.uint32(0)
        if w + 1 < grid.words:
            after = out[row, w + 1]
        wide = word | previous_node(word, before) | next_node(word, after)
        out[row, w] = wide & low_bits(grid.nx - 32 * w)
        before = word


@wp.kernel
def dilate_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: wp.array2d(dtype=wp.uint32),
    steps: wp.array(dtype=wp.vec2i),
    starts: wp.array(dtype=wp.int32),
    # Out:
    out: wp.array2d(dtype=wp.uint32),
) -> None:
    """Cover each node by a ball. One thread a row."""
    row = first + wp.tid()
    for w in range(grid.words):
        out[row, w] = wp.uint32(0)
    widest = starts.shape[0] - 2
    for n in range(widest + 1):
        half = widest - n
        if n > 0:
            widen_row(grid, row, out)
        add_rows(bits, steps, starts[half], starts[half + 1], row, grid.ny, out)
