"""Choose the part of each label that is wanted: opened, closed, its components kept, its cavities filled.

Every label is an object of its own. Nodes that one loses become background, and only background becomes a
label's, so that no label takes another one's nodes. A cavity is a component of the background that reaches no
end of the volume and has one label alone beside it. Labels that were not chosen are background.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import AnyArray, BoolArray, Int32Array
from dmc_cli.field import GridShape, grid_of
from dmc_cli.parts.components import RUN_BYTES, Components, components_of, node_volume, slice_weights
from dmc_cli.parts.label_runs import find_beside_kernel, list_label_runs, recode_runs_kernel
from dmc_cli.runtime import Device
from dmc_cli.settings import PartSettings
from dmc_cli.volume import Volume

Reserve = Callable[[int], None]
"""Is told how many bytes are about to be taken; it may raise."""

Told = list[dict[str, Any]]
"""What was done to each label, under the names that a report has."""

CODE_BYTES = 4
"""Bytes of a run's code."""


def select_labels(
    volume: Volume, count: int, part: PartSettings, device: Device, reserve: Reserve
) -> tuple[Volume, Told]:
    """Return a label map with the part of each label that is wanted, and what was done to each.

    Args:
        volume: The codes of the labels as its values, uint16 [k, j, i].
        count: How many labels there are; the code of the first is 1.
        part: How wide what goes or is filled is, which components to keep, which cavities to fill.
        device: Where to work.
        reserve: Is told how many bytes are about to be taken; it may raise.

    Raises:
        SettingsError: A width reaches no other node.
    """
    reserve(volume.values.nbytes)
    chosen = _LabelNodes(volume, device, lambda more: reserve(volume.values.nbytes + more))
    told: Told = [{} for _ in range(count)]
    for option, name in (("open_gaps", "opened"), ("close_gaps", "closed")):
        if getattr(part, option) is not None:
            boxes = chosen.boxes(count)
            for code, (box, row) in enumerate(zip(boxes, told, strict=True), 1):
                row[name] = chosen.reshape(code, box, option, getattr(part, option))
    components, codes = chosen.components()
    for row, found in zip(told, np.bincount(codes, minlength=count + 1)[1:].tolist(), strict=True):
        row["components"] = found
    if part.most_kept is not None or part.min_volume is not None:
        dropped = _dropped(components, codes, part)
        _tally(told, "dropped", components, codes, dropped)
        chosen.recode(components, np.where(dropped, 0, -1).astype(np.int32))
    if part.largest_cavity is not None:
        components, codes = chosen.components()
        asked = (codes == 0) & ~components.is_open & (components.volume_mm3 <= part.largest_cavity)
        target = chosen.only_code_beside(components, asked)
        _tally(told, "filled", components, target, target > 0)
        chosen.recode(components, target)
    return replace(volume, values=chosen.codes), told


class _LabelNodes:
    """The nodes of a label map while they change.

    Attributes:
        codes: The code of each, uint16 [k, j, i].
    """

    def __init__(self, volume: Volume, device: Device, reserve: Reserve) -> None:
        self.codes = volume.values.copy()
        self._volume, self._device, self._reserve = volume, device, reserve
        self._grid = grid_of(volume.shape, 0)

    def components(self) -> tuple[Components, Int32Array]:
        """Return the components of all labels and of the background, and the code of each."""
        reserve = self._reserve
        rows = self._rows()
        runs = list_label_runs(rows, self._device, lambda count: reserve((RUN_BYTES + CODE_BYTES) * count))
        found = components_of(runs, self._grid, self._volume, self._device, reserve)
        codes = np.zeros(len(found), np.int32)
        codes[found.numbers.numpy()] = runs.code.numpy()
        return found, codes

    def recode(self, components: Components, codes: Int32Array) -> None:
        """Give each component's nodes a code; -1 leaves them as they are."""
        rows, runs, device = self._rows(), components.runs, self._device
        new = wp.array(codes, dtype=wp.int32, device=device.name)
        inputs = [runs.starts, runs.begin, runs.end, components.numbers, new]
        device.launch(recode_runs_kernel, rows.shape[0], inputs, [rows])
        device.finish()
        self.codes = rows.numpy().reshape(self.codes.shape)

    def only_code_beside(self, components: Components, asked: BoolArray) -> Int32Array:
        """Return the code that is the only one beside each component that is asked for, -1 for all others."""
        ends = np.empty((len(asked), 2), np.int32)
        ends[:] = (np.iinfo(np.int32).max, -1)
        beside = wp.array(ends, dtype=wp.int32, device=self._device.name)
        flags = wp.array(asked.astype(np.uint8), dtype=wp.uint8, device=self._device.name)
        runs = components.runs
        inputs = [self._grid.ny, self._rows(), runs.starts, runs.begin, runs.end, components.numbers, flags]
        self._device.launch_whole(find_beside_kernel, self._grid.rows, inputs, [beside])
        low, high = beside.numpy().T
        found: Int32Array = np.where(low == high, low, -1).astype(np.int32)
        return found

    def boxes(self, count: int) -> AnyArray:
        """Return the least and the greatest node of each label along x, y and z, int64 (n, 2, 3)."""
        components, codes = self.components()
        boxes = np.empty((count + 1, 2, 3), np.int64)
        boxes[:, 0], boxes[:, 1] = np.iinfo(np.int64).max, -1
        np.minimum.at(boxes[:, 0], codes, components.low)
        np.maximum.at(boxes[:, 1], codes, components.high)
        return boxes[1:]

    def reshape(self, code: int, box: AnyArray, option: str, width: float) -> dict[str, Any]:
        """Open or close a label in its box, and return how much went or came."""
        from dmc_cli.parts import morphology

        volume, device = self._volume, self._device
        ball = morphology.ball_of(width / 2, volume.spacing, option)
        if box[1, 0] < 0:  # it has no node any more
            return {"nodes": 0, "volume": 0.0}
        reach = 2 * np.array([ball.widest, *np.abs(ball.steps).max(axis=0)]) + 1
        low, high = np.maximum(box[0] - reach, 0), np.minimum(box[1] + reach + 1, np.array(volume.shape))
        codes = self.codes[low[2] : high[2], low[1] : high[1], low[0] : high[0]]
        own = codes == code
        nx, ny, nz = (int(n) for n in high - low)
        grid = grid_of((nx, ny, nz), 0)
        change = morphology.opened if option == "open_gaps" else morphology.closed
        found = _unpacked(change(_packed(own, grid, device), ball, grid, device), grid)
        changed = own & ~found if option == "open_gaps" else found & (codes == 0)
        codes[changed] = 0 if option == "open_gaps" else code
        layers = changed.sum(axis=(1, 2), dtype=np.int64)
        taken = float(layers @ slice_weights(volume)[low[2] : high[2]])
        return {"nodes": int(layers.sum()), "volume": node_volume(volume) * taken}

    def _rows(self) -> Any:
        """Return the codes by rows, on CPU the same memory."""
        rows = self.codes.reshape(-1, self.codes.shape[2])
        return wp.array(rows, dtype=wp.uint16, device=self._device.name, copy=False)


def _dropped(components: Components, codes: Int32Array, part: PartSettings) -> BoolArray:
    """Return which components of labels are not kept; of each label the largest come first."""
    dropped = np.zeros(len(codes), bool)
    if part.most_kept is not None:
        order = np.argsort(codes, kind="stable")
        rank = np.arange(len(codes)) - np.searchsorted(codes[order], codes[order])
        dropped[order] = (codes[order] > 0) & (rank >= part.most_kept)
    if part.min_volume is not None:
        dropped |= (codes > 0) & (components.volume_mm3 < part.min_volume)
    return dropped


def _tally(told: Told, name: str, components: Components, codes: Int32Array, chosen: BoolArray) -> None:
    """Tell of each label how many components were chosen, their nodes and volume."""
    own, size = codes[chosen], len(told) + 1
    counts = np.bincount(own, minlength=size)
    nodes = np.zeros(size, np.int64)
    np.add.at(nodes, own, components.nodes[chosen])
    volumes = np.bincount(own, components.volume_mm3[chosen], minlength=size)
    for code, row in enumerate(told, 1):
        row[name] = {
            "components": int(counts[code]),
            "nodes": int(nodes[code]),
            "volume": float(volumes[code]),
        }


def _packed(nodes: BoolArray, grid: GridShape, device: Device) -> Any:
    """Return a bit for each node, uint32 [row, word]."""
    packed = np.zeros((grid.rows, 4 * grid.words), np.uint8)
    found = np.packbits(nodes.reshape(grid.rows, grid.nx), axis=1, bitorder="little")
    packed[:, : found.shape[1]] = found
    return wp.array(packed.view(np.uint32), dtype=wp.uint32, device=device.name)


def _unpacked(bits: Any, grid: GridShape) -> BoolArray:
    """Return which nodes have a bit, bool [k, j, i]."""
    octets = np.ascontiguousarray(bits.numpy()).view(np.uint8)
    nodes = np.unpackbits(octets, axis=1, count=grid.nx, bitorder="little").astype(bool)
    return nodes.reshape(grid.nz, grid.ny, grid.nx)
