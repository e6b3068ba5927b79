"""Measure how far the vertices are from the isosurface (Grosso & Zint 2021, equation 7).

The deviation of a vertex is |T - stored isovalue| in physical values, T the trilinear interpolant of the
stored values at the vertex's cell-local coordinates, in double precision. The rounding of the file's
coordinates has a part in it only where it counts (`rounding.py`). Divided by the length of T's gradient it
is, to first order, a distance in millimetres; vertices off the surface without a gradient have none. In a
cell that the surface crosses it is no longer than the cell's longest diagonal, whatever the quotient near a
saddle. Where T has no value, beside a node without data, there is nothing to measure.
"""

import math
from dataclasses import dataclass

import numpy as np
import warp as wp

from dmc_cli.field import (
    Field,
    Grid,
    cell_node,
    cell_values,
    slice_depths,
    slice_distance,
    trilinear_slope_u,
    trilinear_slope_v,
    trilinear_slope_w,
    trilinear_value,
)
from dmc_cli.mesh import Placement
from dmc_cli.volume import Volume

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

BLOCK = wp.constant(256)
"""Vertices that one thread sums over: many threads on a GPU, few partial sums."""

SUMS = wp.constant(5)
PEAKS = wp.constant(2)

Sums = wp.types.vector(length=5, dtype=wp.float64)

UNKNOWN = {"mean": None, "rms": None, "max": None, "max_relative": None, "mean_mm": None, "max_mm": None}


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """Distances of the vertices from the isosurface; None without vertices to measure.

    Attributes:
        mean: Mean of |T - stored isovalue|, in physical values.
        rms: Root of its mean square.
        max: Largest.
        max_relative: Largest, as a share of the volume's value range; None if the range is empty.
        mean_mm: Mean distance in millimetres over the vertices that have one; None if none has.
        max_mm: Largest of them.
        rounding_mm: How far rounding to float32 moves a vertex at most, in millimetres; None if not known.
        rounding_relative: The same along an axis, as a share of the spacing.
    """

    mean: float | None
    rms: float | None
    max: float | None
    max_relative: float | None
    mean_mm: float | None
    max_mm: float | None
    rounding_mm: float | None = None
    rounding_relative: float | None = None


@wp.kernel
def measure_deviation_kernel(
    first: wp.int32,
    # In:
    field: Field,
    grid: Grid,
    to_world: wp.mat33d,
    depths: wp.array[wp.float64],
    cells: wp.array[wp.int64],
    local: wp.array[wp.vec3f],
    unit: wp.float64,
    reach: wp.float64,
    # Out:
    sums_out: wp.array2d[wp.float64],
    peaks_out: wp.array2d[wp.float64],
) -> None:
    """Sum the deviations of a block of vertices, in a unit of stored values. One thread a block.

    `to_world` turns a gradient by local coordinates into one by millimetres, `reach` is how far apart two
    points of a cell are at most. Sums: deviation, its square, its distance, vertices with a distance,
    vertices. Peaks: deviation, distance.
    """
    block = first + wp.tid()
    total = Sums()
    peaks = wp.vec2d()
    for vertex in range(block * BLOCK, wp.min((block + 1) * BLOCK, cells.shape[0])):
        node = cell_node(grid, cells[vertex])
        f = cell_values(field, grid, node[0], node[1], node[2]) / unit
        p = local[vertex]
        u = wp.float64(p[0])
        v = wp.float64(p[1])
        w = wp.float64(p[2])
        deviation = wp.abs(trilinear_value(f, u, v, w))
        slope = wp.vec3d(trilinear_slope_u(f, v, w), trilinear_slope_v(f, u, w), trilinear_slope_w(f, u, v))
        slope[2] = slope[2] / slice_distance(depths, node[2])
        if wp.isnan(deviation):
            continue
        total[0] += deviation
        total[1] += deviation * deviation
        total[4] += wp.float64(1.0)
        peaks[0] = wp.max(peaks[0], deviation)
        gradient = wp.length(to_world * slope)
        if gradient > wp.float64(0.0) or deviation == wp.float64(0.0):
            distance = wp.where(gradient > wp.float64(0.0), deviation / gradient, wp.float64(0.0))
            if wp.min(f) <= wp.float64(0.0) and wp.max(f) >= wp.float64(0.0):
                distance = wp.min(distance, reach)
            total[2] += distance
            total[3] += wp.float64(1.0)
            peaks[1] = wp.max(peaks[1], distance)
    for s in range(SUMS):
        sums_out[block, s] = total[s]
    for s in range(PEAKS):
        peaks_out[block, s] = peaks[s]


def measure_deviation(
    placement: Placement, volume: Volume, value_range: tuple[float, float] | None
) -> Deviation:
    """Measure the deviation of vertices from the isosurface that their field is zero on.

    Args:
        placement: Where they lie.
        volume: The volume, for its affine and slope.
        value_range: Smallest and largest physical value, as `Volume.value_range` returns it.
    """
    frame, count = placement.frame, placement.cell.shape[0]
    device, field, grid = frame.device, frame.field, frame.grid
    if not count:
        return Deviation(**UNKNOWN)
    blocks = -(-count // int(BLOCK))
    sums = device.empty((blocks, int(SUMS)), wp.float64)
    peaks = device.empty((blocks, int(PEAKS)), wp.float64)
    to_world = wp.mat33d(*np.linalg.inv(volume.affine[:3, :3]).T.ravel())
    extent = value_range[1] - value_range[0] if value_range else 0.0
    power = _unit(volume, value_range, field.isovalue)
    inputs = [field, grid.struct(), to_world, slice_depths(volume, grid, device)]
    inputs += [placement.cell, placement.local, power, _longest_diagonal(volume)]
    device.launch(measure_deviation_kernel, blocks, inputs=inputs, outputs=[sums, peaks])
    total, squares, distance, distances, count = sums.numpy().sum(axis=0).tolist()
    if not count:
        return Deviation(**UNKNOWN)
    most, farthest = peaks.numpy().max(axis=0).tolist()
    unit = abs(volume.slope) * power
    return Deviation(
        mean=unit * total / count,
        rms=unit * math.sqrt(squares / count),
        max=unit * most,
        max_relative=unit * most / extent if 0.0 < extent < math.inf else None,
        mean_mm=distance / distances if distances else None,
        max_mm=farthest if distances else None,
    )


def _longest_diagonal(volume: Volume) -> float:
    """Return the length of the longest diagonal of a cell, in millimetres."""
    steps = np.array(volume.affine[:3, :3], np.float64)
    if volume.slice_positions is not None:
        steps[:, 2] *= np.abs(np.diff(volume.slice_positions)).max() / volume.spacing[2]
    signs = np.array([[1, 1, 1, 1], [1, 1, -1, -1], [1, -1, 1, -1]])
    return float(np.linalg.norm(steps @ signs, axis=0).max())


def _unit(volume: Volume, value_range: tuple[float, float] | None, isovalue: float) -> float:
    """Return a power of two near the largest |F|: a unit that keeps squares in reach and costs no digit."""
    stored = [(end - volume.intercept) / volume.slope for end in value_range or ()]
    largest = max((abs(value - isovalue) for value in stored), default=1.0)
    if not (largest > 0.0 and math.isfinite(largest)):
        return 1.0 if largest == 0.0 else 2.0**1000
    return 2.0 ** min(max(math.frexp(largest)[1], -1000), 1000)
