"""Keep a box of a volume's nodes: what lies in it stays exactly where it was."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.crops import AXES, Span, parse_crop
from dmc_cli.errors import SettingsError
from dmc_cli.volume import Volume

LEAST = 2
"""Nodes along an axis, at least: a cell."""


def crop_volume(volume: Volume, crop: str, reserve: Callable[[int], None] | None = None) -> Volume:
    """Return the volume of a box of nodes.

    Args:
        volume: The volume.
        crop: The box, as `--crop` takes it.
        reserve: Is told how many bytes its values take, before they are taken; it may raise.

    Raises:
        SettingsError: No cell of the volume lies in it.
    """
    spans = parse_crop(crop)
    if any(span.unit == "mm" for span in spans):
        ranges = _world_ranges(volume, spans)
    else:
        ranges = [_node_range(span, count) for span, count in zip(spans, volume.shape, strict=True)]
    kept = []
    for axis, (first, last) in enumerate(ranges):
        count = volume.shape[axis]
        if spans[axis].unit == "nodes" and (first >= count or last >= count):
            raise _outside(volume, crop, f"{AXES[axis]} ends at node {count - 1}")
        first, last = max(first, 0), min(last, count - 1)  # noqa: PLW2901 - what of it is there
        if last - first + 1 < LEAST:
            raise _outside(volume, crop, f"along {AXES[axis]} no two nodes lie in it")
        kept.append(slice(first, last + 1))
    affine = volume.affine.copy()
    affine[:3, 3] += affine[:3, :3] @ _start(volume, [part.start for part in kept])
    positions = volume.slice_positions
    if positions is not None:
        positions = positions[kept[2]] - positions[kept[2].start]
        step = float(np.mean(np.diff(positions)))
        affine[:3, 2] *= step / np.linalg.norm(affine[:3, 2])
    inside = volume.values[kept[2], kept[1], kept[0]]
    if reserve is not None:
        reserve(inside.nbytes)
    values = np.ascontiguousarray(inside)
    return replace(volume, values=values, affine=affine, slice_positions=positions)


def _start(volume: Volume, first: list[int]) -> Float64Array:
    """Return the place of a node as the affine takes it: uneven slices count where they are."""
    place = np.array(first, np.float64)
    if volume.slice_positions is not None:
        place[2] = volume.slice_positions[first[2]] / volume.spacing[2]
    return place


def _node_range(span: Span, count: int) -> tuple[int, int]:
    """Return the first and last node of a span in nodes or percent."""
    if span.unit == "nodes":
        return int(span.first or 0), int(span.last) if span.last is not None else count - 1
    first, last = span.first or 0.0, 100.0 if span.last is None else span.last
    return int(np.ceil(first / 100 * (count - 1) - 1e-9)), int(np.floor(last / 100 * (count - 1) + 1e-9))


def _world_ranges(volume: Volume, spans: tuple[Span, Span, Span]) -> list[tuple[int, int]]:
    """Return the least box of nodes with all those between bounds in mm along the axes of the volume's space.

    Raises:
        SettingsError: Bounds in mm stand beside others, which are along the grid.
    """
    if any(span.unit != "mm" and (span.first, span.last) != (None, None) for span in spans):
        raise SettingsError(
            "crop has bounds in mm, of the volume's space, and others, of its grid; expected one kind for x,"
            " y and z; give all in mm, or none"
        )
    nx, ny, nz = volume.shape
    depths = np.arange(nz, dtype=np.float64)
    if volume.slice_positions is not None:
        depths = volume.slice_positions / volume.spacing[2]
    i, j = np.arange(nx, dtype=np.float64)[:, None], np.arange(ny, dtype=np.float64)
    planes = [volume.affine[a, 0] * i + volume.affine[a, 1] * j + volume.affine[a, 3] for a in range(3)]
    ranges = np.array([[nx, ny, nz], [-1, -1, -1]])
    for k, depth in enumerate(depths):
        within = np.ones((nx, ny), bool)
        for span, plane, step in zip(spans, planes, volume.affine[:3, 2], strict=True):
            if span.first is not None:
                within &= plane >= span.first - step * depth
            if span.last is not None:
                within &= plane <= span.last - step * depth
        columns, rows = np.flatnonzero(within.any(axis=1)), np.flatnonzero(within.any(axis=0))
        if len(columns):
            ranges[0] = np.minimum(ranges[0], (columns[0], rows[0], k))
            ranges[1] = np.maximum(ranges[1], (columns[-1], rows[-1], k))
    return [(int(first), int(last)) for first, last in ranges.T]


def _outside(volume: Volume, crop: str, found: str) -> SettingsError:
    """Return the error that tells where the volume lies."""
    corners = np.array(np.meshgrid(*[(0, n - 1) for n in volume.shape], indexing="ij")).reshape(3, -1)
    if volume.slice_positions is not None:
        corners = corners.astype(np.float64)
        corners[2] = np.where(corners[2] > 0, volume.slice_positions[-1] / volume.spacing[2], 0.0)
    points = volume.affine[:3, :3] @ corners + volume.affine[:3, 3:]
    ends = ", ".join(f"{low:g}:{high:g}" for low, high in zip(points.min(1), points.max(1), strict=True))
    nodes = ",".join(f"0:{n - 1}" for n in volume.shape)
    return SettingsError(
        f"crop is {crop!r:.80}: {found}; expected a box that holds a cell of the volume; it has the nodes"
        f" {nodes}, from {ends} mm"
    )
