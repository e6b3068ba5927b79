"""Keep the least and the greatest value of each brick of nodes: a min/max index.

A brick has 32 nodes along x, a word of bits, and `BRICK` along y and z. Bricks on one side of an isovalue are
not read again at it: the span space of Livnat et al. (1996) at the resolution of bricks. A tree of them, as
the HistoPyramids of Schmitz et al. (2009) are, has its levels looked at one after the other; here one level
is, in the order of the words that it leaves to be read.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.field.grid import Grid
from dmc_cli.runtime import Device, native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

BRICK = wp.constant(8)
"""Nodes of a brick along y and z."""


NodeSteps = wp.types.vector(length=2, dtype=wp.int64)
"""Nodes from a row to the next one, and from a layer to the next one."""


@dataclass(frozen=True)
class BrickRanges:
    """Ranges of the stored values of bricks, row by row of bricks; infinite where a value is not finite.

    Attributes:
        low: The least value, float64 [row of bricks, word].
        high: The greatest value, likewise.
    """

    low: Any
    high: Any

    def crossed_share(self, threshold: float) -> float:
        """Return the share of bricks with values below `threshold` and others at or above it."""
        low, high = self.low.numpy(), self.high.numpy()
        return float(np.count_nonzero((low < threshold) & (high >= threshold)) / max(low.size, 1))


def make_brick_ranges(shape: tuple[int, int, int], device: Device) -> BrickRanges:
    """Return room for the ranges of a volume of (nx, ny, nz) nodes."""
    words, rows, layers = -(-shape[0] // 32), *(-(-n // BRICK) for n in shape[1:])
    low, high = (device.empty((rows * layers, words), wp.float64) for _ in range(2))
    return BrickRanges(low, high)


@wp.func
def bricks_begin(grid: Grid, bricks: wp.int32) -> wp.vec2i:
    """Return j and k, in the volume, of the first row of a row of bricks."""
    across = (grid.ny - 2 * grid.border + BRICK - 1) / BRICK
    return wp.vec2i(bricks % across * BRICK, bricks / across * BRICK)


@wp.func
def bricks_end(begin: wp.int32, count: wp.int32) -> wp.int32:
    """Return where bricks end along y or z that begin there, of so many nodes of the volume."""
    return wp.min(begin + BRICK, count)


@wp.func_native(native(__file__, "widen_ranges"))
def widen_ranges(
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    at: wp.int64,
    count: wp.int32,
    is_first: wp.bool,
    low: wp.array2d(dtype=wp.float64),
    high: wp.array2d(dtype=wp.float64),
    row: wp.int32,
) -> None:
    """Widen the ranges of a row of bricks by `count` nodes from `at` on; the first ones begin them."""
    ...


@wp.func_native(native(__file__, "compare_bricks"))
def compare_bricks(
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    at: wp.int64,
    size: wp.vec3i,
    step: NodeSteps,
    threshold: wp.float64,
    low: wp.array2d(dtype=wp.float64),
    high: wp.array2d(dtype=wp.float64),
    bricks: wp.int32,
    out: wp.array2d(dtype=wp.uint32),
    row: wp.int32,
    layer: wp.int32,
) -> None:
    """Write a bit for each node of a row of bricks: is it at or above a number?

    Nodes are read only where the range leaves it open. The bricks have `size` nodes along x, y and z from
    node `at` on, rows and layers `step` nodes apart; their bits begin in row `row`, layers are `layer`
    rows apart.
    """
    ...
