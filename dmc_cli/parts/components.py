"""Find the connected components of the object's nodes, or of those outside it: size, volume, bounds.

A node stands for the box round it, half a spacing each way.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray, Float64Array, Int32Array, Int64Array, IntArray
from dmc_cli.contouring import find_inside
from dmc_cli.field import DeviceVolume, Grid, GridShape, grid_of
from dmc_cli.parts.joining import join_runs
from dmc_cli.parts.runs import Runs, list_runs, mark_runs_kernel, meet_runs_kernel
from dmc_cli.runtime import Device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

UNIT = 1 << 16
"""Parts of a node's volume, in whole numbers of which sums are exact, whatever their order."""

RUN_BYTES = 4 + 4 + 4 + 4 + 1 + 4
"""Bytes a run takes: its ends, its parent, its root, whether it is one and how many there are before it."""

COMPONENT_BYTES = 2 * 8 + 2 * 7 * 4 + 8 + 4 + 2 * 8 + 6 * 8 + 1
"""Bytes a component takes while it is measured and then: sums, boxes, its place in the order, fields."""

RENUMBERED = 1 << 18
"""Runs that are renumbered at a time."""

KEPT_RUN_BYTES = 4 + 4 + 4
"""Bytes a run of components takes that were found: its ends and its component's number."""

Reserve = Callable[[int], None]
"""Is told how many bytes are about to be taken in all; it may raise."""


@dataclass(frozen=True)
class Components:
    """The components of a set of nodes, the largest first, of equal ones the one that begins first.

    Attributes:
        runs: The runs of the set.
        numbers: The component of each run, int32 (n,), on the device.
        nodes: How many nodes each has, int64 (c,).
        volume_mm3: What their boxes take, float64 (c,).
        low: The least node along x, y, z, int64 (c, 3).
        high: The greatest one.
        is_open: Whether it reaches an end of the volume or of its data, bool (c,).
    """

    runs: Runs
    numbers: Any
    nodes: Int64Array
    volume_mm3: Float64Array
    low: Int64Array
    high: Int64Array
    is_open: BoolArray

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.nodes)

    @property
    def nbytes(self) -> int:
        """Return the bytes that they take, with their runs."""
        fields = (self.nodes, self.volume_mm3, self.low, self.high, self.is_open)
        return KEPT_RUN_BYTES * self.runs.count + sum(each.nbytes for each in fields)


@dataclass(frozen=True)
class NodeSets:
    """The nodes of the object and the others, a bit a node, uint32 [row, word].

    Attributes:
        inside: Nodes with data at or above the isovalue.
        data: Nodes with data; None where all have.
        grid: The volume's own grid.
    """

    inside: Any
    data: Any | None
    grid: GridShape

    def object_bits(self, *, is_inside: bool) -> Any:
        """Return the bits of the object: the nodes at or above the isovalue, or those with data below it."""
        return self.inside if is_inside else self._rest(self.inside, self.data)

    def outer_bits(self, *, is_inside: bool) -> Any:
        """Return the bits of all nodes that are none of the object's, those without data among them."""
        return self._rest(self.object_bits(is_inside=is_inside), None)

    def _rest(self, bits: Any, among: Any | None) -> Any:
        """Return the bits of the nodes that have none."""
        device = str(bits.device)
        found = ~bits.numpy()
        if among is not None:
            found &= among.numpy()
        if self.grid.nx % 32:
            found[:, -1] &= np.uint32((1 << self.grid.nx % 32) - 1)
        return wp.array(found, dtype=wp.uint32, device=device)


def find_sets(volume: DeviceVolume, settings: SurfaceSettings) -> NodeSets:
    """Return which nodes lie on which side of the isovalue."""
    grid = grid_of(volume.volume.shape, 0)
    plain = SurfaceSettings(isovalue=settings.isovalue, inside=settings.inside)  # an open border
    found = find_inside(volume, plain, grid)
    volume.device.finish()
    inside = found.inside.rows
    if found.data is None:
        return NodeSets(inside, None, grid)
    return NodeSets(wp.array(inside.numpy() & found.data.numpy(), dtype=wp.uint32), found.data, grid)


def find_components(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    sets: NodeSets,
    *,
    of_object: bool,
    reserve: Reserve | None = None,
) -> Components:
    """Return the components of the object's nodes, or of all others.

    Args:
        volume: The volume on its device.
        settings: The isovalue, and which side is the object.
        sets: The nodes on both sides.
        of_object: Which of both sets.
        reserve: Is told how many bytes that takes, before they are taken; it may raise.
    """
    device, grid = volume.device, sets.grid
    is_inside = settings.inside == "above"
    bits = sets.object_bits(is_inside=is_inside) if of_object else sets.outer_bits(is_inside=is_inside)
    beside = (3 if of_object else 4) * bits.size * 4  # those of both sides, of what is asked, and a copy

    def reserve_more(count: int) -> None:
        if reserve is not None:
            reserve(beside + count)

    runs = list_runs(bits, device, lambda count: reserve_more(RUN_BYTES * count))
    missing = sets.data if sets.data is not None and not of_object else None
    return components_of(runs, grid, volume.volume, device, reserve_more, missing)


def components_of(
    runs: Runs,
    grid: GridShape,
    volume: Volume,
    device: Device,
    reserve: Callable[[int], None],
    data: Any | None = None,
) -> Components:
    """Return the components of runs of a volume's nodes.

    Args:
        runs: The runs.
        grid: The grid of the volume's nodes.
        volume: The volume, for what a node takes.
        device: Where to work.
        reserve: Is told how many bytes that takes, the runs counted in; it may raise.
        data: A bit for each node with data, uint32 [row, word], where others leave a component open.
    """
    numbers = join_runs(runs, grid, device).numpy()
    count = _number(numbers)
    reserve(KEPT_RUN_BYTES * runs.count + COMPONENT_BYTES * count)
    totals = wp.zeros((count, 2), dtype=wp.int64, device=device.name)
    boxes = np.empty((count, 7), np.int32)
    boxes[:, :3], boxes[:, 3:] = np.iinfo(np.int32).max, -1
    ends = wp.array(boxes, dtype=wp.int32, device=device.name)
    label = wp.array(numbers, dtype=wp.int32, device=device.name, copy=False)
    missing = data if data is not None else device.empty((0, 0), wp.uint32)
    inputs = [grid.struct(), runs.starts, runs.begin, runs.end, label, missing]
    weight = wp.array(slice_weights(volume), dtype=wp.int64, device=device.name)
    device.launch_whole(measure_runs_kernel, grid.rows, [*inputs, weight], [totals, ends])
    return _sorted(runs, numbers, totals.numpy(), ends.numpy(), volume, device)


def _number(root: Int32Array) -> int:
    """Turn the root of each run into the number of its component, by their first runs; return how many."""
    is_root = root == np.arange(len(root), dtype=np.int32)
    order = np.cumsum(is_root, dtype=np.int32)
    order -= 1
    _renumber(root, order)
    return int(order[-1]) + 1 if len(order) else 0


def _renumber(numbers: Int32Array, new: Int32Array) -> None:
    """Turn each number into what is new for it; in pieces, since indices are widened."""
    for first in range(0, len(numbers), RENUMBERED):
        part = numbers[first : first + RENUMBERED]
        part[...] = new[part]


def _sorted(
    runs: Runs, numbers: Int32Array, totals: Int64Array, ends: IntArray, volume: Volume, device: Device
) -> Components:
    """Return components, numbered in the order of their first runs, in the order of their volumes.

    `numbers` become those of that order.
    """
    order = np.argsort(-totals[:, 1], kind="stable")
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order))
    _renumber(numbers, rank)
    unit = node_volume(volume)
    return Components(
        runs=runs,
        numbers=wp.array(numbers, dtype=wp.int32, device=device.name, copy=False),
        nodes=totals[order, 0],
        volume_mm3=totals[order, 1] * unit,
        low=ends[order, :3].astype(np.int64),
        high=ends[order, 3:6].astype(np.int64),
        is_open=ends[order, 6] > 0,
    )


def tally(found: Components, chosen: BoolArray) -> dict[str, Any]:
    """Return how many components were chosen, their nodes and volume, as a report has them."""
    return {
        "components": int(np.count_nonzero(chosen)),
        "nodes": int(found.nodes[chosen].sum()),
        "volume": float(found.volume_mm3[chosen].sum()),
    }


def node_volume(volume: Volume) -> float:
    """Return what a `UNIT`th of a node takes, in mm3."""
    return abs(float(np.linalg.det(volume.affine[:3, :3]))) / UNIT


def slice_weights(volume: Volume) -> Int64Array:
    """Return what a node of each slice takes, in parts of a node at the mean spacing, int64 (nz,)."""
    positions = volume.slice_positions
    if positions is None:
        return np.full(volume.shape[2], UNIT, np.int64)
    steps = np.diff(positions) / volume.spacing[2]
    thick = (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2
    return np.rint(thick * UNIT).astype(np.int64)


def mark_components(
    components: Components, is_marked: BoolArray, grid: GridShape, volume: DeviceVolume
) -> Any:
    """Return the bits of the nodes of marked components, uint32 [row, word], on the host."""
    device, runs = volume.device, components.runs
    bits = device.empty((grid.rows, grid.words), wp.uint32)
    marks = wp.array(is_marked.astype(np.uint8), dtype=wp.uint8, device=device.name)
    device.launch(
        mark_runs_kernel, grid.rows, [runs.starts, runs.begin, runs.end, components.numbers, marks], [bits]
    )
    return bits.numpy()


def meeting_components(components: Components, bits: Any, grid: GridShape, volume: DeviceVolume) -> BoolArray:
    """Return which components have a node of a set, uint32 [row, word]; bool (c,)."""
    device, runs = volume.device, components.runs
    meets = device.empty(runs.count, wp.uint8)
    device.launch(meet_runs_kernel, grid.rows, [runs.starts, runs.begin, runs.end, bits], [meets])
    found = np.zeros(len(components), bool)
    found[components.numbers.numpy()[meets.numpy() != 0]] = True
    return found


def size_of(bits: Any, grid: GridShape, volume: Volume) -> dict[str, Any]:
    """Return how many nodes a set has, uint32 [row, word], and their volume, as a report has them."""
    layers = np.bitwise_count(bits).reshape(grid.nz, -1).sum(axis=1, dtype=np.int64)
    weight = float(layers @ slice_weights(volume))
    return {"nodes": int(layers.sum()), "volume": node_volume(volume) * weight}


@wp.kernel
def measure_runs_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    component: wp.array(dtype=wp.int32),
    data: wp.array2d(dtype=wp.uint32),
    weights: wp.array(dtype=wp.int64),
    # In and out:
    totals_inout: wp.array2d(dtype=wp.int64),
    ends_inout: wp.array2d(dtype=wp.int32),
) -> None:
    """Add each run to its component: nodes, weight; least and greatest place; whether it is open.

    Sums and extremes of whole numbers are the same in any order. One thread a row.
    """
    row = first + wp.tid()
    k = row / grid.ny
    j = row - k * grid.ny
    at_end = j == 0 or j == grid.ny - 1 or k == 0 or k == grid.nz - 1
    for n in range(wp.int32(starts[row]), wp.int32(starts[row + 1])):
        c = component[n]
        length = wp.int64(end[n] - begin[n])
        wp.atomic_add(totals_inout, c, 0, length)
        wp.atomic_add(totals_inout, c, 1, length * weights[k])
        wp.atomic_min(ends_inout, c, 0, begin[n])
        wp.atomic_min(ends_inout, c, 1, j)
        wp.atomic_min(ends_inout, c, 2, k)
        wp.atomic_max(ends_inout, c, 3, end[n] - 1)
        wp.atomic_max(ends_inout, c, 4, j)
        wp.atomic_max(ends_inout, c, 5, k)
        is_open = at_end or begin[n] == 0 or end[n] == grid.nx
        if data.shape[0] > 0 and not is_open:
            is_open = lacks_data(data, row, begin[n], end[n])
        if is_open:
            wp.atomic_max(ends_inout, c, 6, 1)


@wp.func
def lacks_data(data: wp.array2d(dtype=wp.uint32), row: wp.int32, begin: wp.int32, end: wp.int32) -> wp.bool:
    """Return whether a run has a node without data."""
    found = bool(False)
    for i in range(begin, end):
        found = found or ((data[row, i / 32] >> wp.uint32(i % 32)) & wp.uint32(1)) == wp.uint32(0)
    return found
