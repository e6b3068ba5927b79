"""Blend values along one axis after another: each new value is a weighted sum of neighbouring ones.

Smoothing and resampling are such sums, in float32.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from dmc_cli.array_types import Float32Array, Float64Array, Int32Array, IntArray
from dmc_cli.bits import VECTOR_FLAGS
from dmc_cli.runtime import Device, native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

FLOAT_BYTES = 4

ROWS_A_CHUNK = 8
"""Rows a chunk at least, as `ITEMS_A_CHUNK` of the device."""


@dataclass(frozen=True)
class Blend:
    """The sums along an axis.

    Attributes:
        starts: The first node of each new one, int32 (m,).
        weights: What the nodes from there on weigh, each row 1 together, float32 (m, taps).
    """

    starts: Int32Array
    weights: Float32Array


def blend_of(sums: Sequence[tuple[IntArray, Float64Array]], nodes: int) -> Blend:
    """Return the sums of nodes along an axis; what lies beyond its ends counts for the node at the end.

    Args:
        sums: For each new node the numbers of nodes, int (n,), ascending, and their weights, float64 (n,).
        nodes: How many there are.
    """
    taps = min(max(int(at[-1] - at[0]) + 1 for at, _ in sums), nodes)
    starts = np.empty(len(sums), np.int32)
    weights = np.zeros((len(sums), taps), np.float64)
    for m, (at, weight) in enumerate(sums):
        inner = np.clip(at, 0, nodes - 1)
        starts[m] = min(int(inner[0]), nodes - taps)
        np.add.at(weights[m], inner - starts[m], weight)
    return Blend(starts, (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32))


def blending_bytes(old: Sequence[int], new: Sequence[int]) -> int:
    """Return the bytes at most of values of `old` nodes along x, y and z while they are blended to `new`."""
    nx, ny, nz = new
    counts = [math.prod(old), old[0] * old[1] * nz, old[0] * ny * nz, nx * ny * nz]
    if counts[0] == counts[-1]:
        return FLOAT_BYTES * 2 * counts[0]
    return FLOAT_BYTES * (counts[0] + counts[2] + max(counts[1], counts[3]))


def blended(values: Float32Array, blends: Sequence[Blend | None], device: Device) -> Float32Array:
    """Return values blended along x, y and z, float32 [k, j, i] on the host.

    Args:
        values: float32 [k, j, i], finite; what they are afterwards is left open.
        blends: The sums along x, y and z; None along an axis that stays as it is.
        device: Where to work.
    """
    nz, ny, nx = values.shape
    current = wp.array(values.reshape(nz * ny, nx), dtype=wp.float32, device=device.name, copy=False)
    keeps_nodes = all(
        blend is None or len(blend.starts) == n for blend, n in zip(blends, (nx, ny, nz), strict=True)
    )
    spare = None
    for axis, kernel in ((2, blend_z_kernel), (1, blend_y_kernel), (0, blend_x_kernel)):
        blend = blends[axis]
        if blend is None:
            continue
        arrays = [wp.array(part, device=device.name) for part in (blend.starts, blend.weights)]
        shape = [nx, ny, nz]
        shape[axis] = len(blend.starts)
        size = (shape[1] * shape[2], shape[0])
        out = device.empty(size, wp.float32) if spare is None else spare
        device.launch(kernel, out.shape[0], [current, *arrays, ny, shape[1]], [out], ROWS_A_CHUNK)
        nx, ny, nz = shape
        current, spare = out, current if keeps_nodes else None
    found: Float32Array = current.numpy().reshape(nz, ny, nx)
    return found


@wp.func_native(native(__file__, "blend_rows"))
def blend_rows(
    values: wp.array2d(dtype=wp.float32),
    first: wp.int32,
    count: wp.int32,
    step: wp.int32,
    weights: wp.array2d(dtype=wp.float32),
    at: wp.int32,
    out: wp.array2d(dtype=wp.float32),
    row: wp.int32,
) -> None:
    """Write a row of sums of `count` rows from `first` on, `step` rows apart, weighted by row `at`."""
    ...


@wp.func_native(native(__file__, "blend_row"))
def blend_row(
    values: wp.array2d(dtype=wp.float32),
    starts: wp.array(dtype=wp.int32),
    count: wp.int32,
    weights: wp.array2d(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    row: wp.int32,
) -> None:
    """Write a row of weighted sums of `count` values each of the same row."""
    ...


@wp.kernel
def blend_x_kernel(
    # In:
    first: wp.int32,
    values: wp.array2d(dtype=wp.float32),
    starts: wp.array(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    old_ny: wp.int32,
    ny: wp.int32,
    # Out:
    out: wp.array2d(dtype=wp.float32),
) -> None:
    """Blend along x. One thread a row."""
    row = first + wp.tid()
    blend_row(values, starts, weights.shape[1], weights, out, row)


@wp.kernel
def blend_y_kernel(
    # In:
    first: wp.int32,
    values: wp.array2d(dtype=wp.float32),
    starts: wp.array(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    old_ny: wp.int32,
    ny: wp.int32,
    # Out:
    out: wp.array2d(dtype=wp.float32),
) -> None:
    """Blend along y. One thread a new row."""
    row = first + wp.tid()
    k = row / ny
    j = row - k * ny
    blend_rows(values, k * old_ny + starts[j], weights.shape[1], 1, weights, j, out, row)


@wp.kernel
def blend_z_kernel(
    # In:
    first: wp.int32,
    values: wp.array2d(dtype=wp.float32),
    starts: wp.array(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    old_ny: wp.int32,
    ny: wp.int32,
    # Out:
    out: wp.array2d(dtype=wp.float32),
) -> None:
    """Blend along z. One thread a new row."""
    row = first + wp.tid()
    k = row / ny
    j = row - k * ny
    blend_rows(values, ny * starts[k] + j, weights.shape[1], ny, weights, k, out, row)
