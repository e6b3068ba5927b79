"""Take the labels of a label map at nodes of another distance: the label that most of a node's sum has.

Where new nodes are nearer along an axis that is the label of the nearest node, of two as near the first;
where they are farther apart, that of the most nodes in the triangle that a value would be the mean of
(`filtering.py`). Of labels with as much the smaller one counts, and any before the background.
"""

from dataclasses import replace

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array
from dmc_cli.parts.blending import Blend, blended
from dmc_cli.parts.filtering import resampling
from dmc_cli.runtime import Device
from dmc_cli.volume import Volume

ROUNDING = 1e-4
"""Share of a node by which sums of float32 may differ that are as large."""


def resampled_labels(volume: Volume, count: int, step: str, device: Device) -> Volume:
    """Return a label map with nodes as far apart as `step` says, in mm, or `isotropic`, as the nearest are.

    Args:
        volume: The codes of the labels as its values, uint16 [k, j, i].
        count: How many labels there are; the code of the first is 1.
        step: The distance.
        device: Where to work.

    Raises:
        SettingsError: That makes fewer than two nodes along an axis, or too many.
    """
    blends, affine = resampling(volume, step)
    sums = [None if blend is None else _nearest(blend) for blend in blends]
    old = volume.values.shape[::-1]
    shape = [size if one is None else len(one.starts) for size, one in zip(old, sums, strict=True)][::-1]
    codes, best, total = np.zeros(shape, np.uint16), np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for code in range(1, count + 1):
        nodes = volume.values == code
        if nodes.any():
            share, place = _share(nodes, sums, device)
            is_more = share > best[place] + ROUNDING
            codes[place][is_more] = code
            np.maximum(best[place], share, out=best[place])
            total[place] += share
    codes[1.0 - total > best + ROUNDING] = 0
    return replace(volume, values=codes, affine=affine, slice_positions=None)


def _nearest(blend: Blend) -> Blend:
    """Return a sum of two nodes as the nearest one alone; sums of more stay."""
    if blend.weights.shape[1] != 2:
        return blend
    is_second = blend.weights[:, 1] > 0.5 + ROUNDING
    return Blend(blend.starts, np.stack([~is_second, is_second], axis=1).astype(np.float32))


def _share(
    nodes: AnyArray, sums: list[Blend | None], device: Device
) -> tuple[Float32Array, tuple[slice, ...]]:
    """Return what share of new nodes' sums some nodes are, and where these new nodes lie, [k, j, i]."""
    inner: list[Blend | None] = []
    old: list[slice] = []
    new: list[slice] = []
    for axis, one in zip((2, 1, 0), sums, strict=True):
        there = np.flatnonzero(nodes.any(axis=tuple({0, 1, 2} - {axis})))
        low, high = int(there[0]), int(there[-1])
        if one is None:
            inner.append(None)
            old.append(slice(low, high + 1))
            new.append(slice(low, high + 1))
            continue
        taps = one.weights.shape[1]
        rows = np.flatnonzero((one.starts <= high) & (one.starts + taps > low))
        first, last = (int(rows[0]), int(rows[-1])) if len(rows) else (0, -1)
        starts = one.starts[first : last + 1]
        start = int(starts.min()) if len(rows) else 0
        inner.append(Blend(starts - np.int32(start), one.weights[first : last + 1]))
        old.append(slice(start, int(starts.max()) + taps if len(rows) else 0))
        new.append(slice(first, last + 1))
    place = tuple(new[::-1])
    if any(part.stop <= part.start for part in place):
        return np.zeros([max(part.stop - part.start, 0) for part in place], np.float32), place
    values = np.ascontiguousarray(nodes[tuple(old[::-1])], dtype=np.float32)
    return blended(values, inner, device), place
