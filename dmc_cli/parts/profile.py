"""Find what goes on along the slices as a profile does: nodes that most other slices have in the same place.

The scanner's axis counts where it is known and the slices lie across it, as with a tilted gantry, whose
slices move against each other; else that of the slices.
"""

import numpy as np
import warp as wp

from dmc_cli.array_types import ByteArray, Float64Array, Int64Array
from dmc_cli.field import GridShape, grid_of
from dmc_cli.parts.morphology import ball_of, dilated
from dmc_cli.runtime import Device
from dmc_cli.volume import Volume


def profile_nodes(bits: wp.array, volume: Volume, device: Device, nearby: float, share: float) -> wp.array:
    """Return the nodes of a set that have others of it in so many slices, uint32 [row, word].

    Args:
        bits: The set, uint32 [row, word].
        volume: Where its nodes lie.
        device: Where to work.
        nearby: How far from the same place another node may be in its slice, in mm.
        share: The share of the slices that have nodes of the set.
    """
    grid, starts = grid_of(volume.shape, 0), _starts(volume)
    own = bits.numpy().reshape(grid.nz, grid.ny, grid.words)
    near = _widened(bits, volume, grid, device, nearby).numpy().reshape(own.shape)
    tall, wide = starts.max(axis=0) + np.array((grid.ny, grid.nx))
    counts = np.zeros((tall, wide), np.uint16)
    for (y, x), rows in zip(starts, near, strict=True):
        counts[y : y + grid.ny, x : x + grid.nx] += _unpacked(rows, grid)
    is_often = counts >= share * np.count_nonzero(own.any(axis=(1, 2)))
    found = np.zeros_like(own)
    for (y, x), out in zip(starts, found.view(np.uint8), strict=True):
        often = np.packbits(is_often[y : y + grid.ny, x : x + grid.nx], axis=1, bitorder="little")
        out[:, : often.shape[1]] = often
    found &= own
    return wp.array(found.reshape(bits.shape), dtype=wp.uint32, device=device.name)


def _widened(bits: wp.array, volume: Volume, grid: GridShape, device: Device, nearby: float) -> wp.array:
    """Return what is near the nodes of a set in their slices, uint32 [row, word]."""
    x, y, _ = volume.spacing
    if nearby < min(x, y):
        return bits
    return dilated(bits, ball_of(nearby, (x, y, 2 * nearby), "cut_table"), grid, device)


def _starts(volume: Volume) -> Int64Array:
    """Return where slices begin along y and x of a frame that follows the axis, int64 (nz, 2), from 0."""
    depths = np.arange(volume.shape[2], dtype=np.float64)
    if volume.slice_positions is not None:
        depths = volume.slice_positions / volume.spacing[2]
    moves = np.rint(-np.outer(depths, _drift(volume)[::-1])).astype(np.int64)
    return moves - moves.min(axis=0)


def _drift(volume: Volume) -> Float64Array:
    """Return by how many nodes the scanner's axis moves along x and y from slice to slice, float64 (2,)."""
    if volume.space == "none":
        return np.zeros(2)
    way = np.linalg.solve(volume.affine[:3, :3], (0.0, 0.0, 1.0))
    across = np.abs(way * volume.spacing)
    return np.zeros(2) if across[2] <= across[:2].max() else way[:2] / way[2]


def _unpacked(rows: np.ndarray, grid: GridShape) -> ByteArray:
    """Return a byte for each node of a slice, uint8 [j, i]."""
    return np.unpackbits(np.ascontiguousarray(rows).view(np.uint8), axis=1, count=grid.nx, bitorder="little")
