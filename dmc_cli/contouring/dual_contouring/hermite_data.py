"""Ask a known field for the crossings of cells and the normals there (Hermite data; Ju et al. 2002).

The linear interpolant of two values is off where a face ends between the nodes, so crossings are looked for
on the field itself where its formula is known. On a cap that closes the border the field tells nothing: there
the crossing stays, and a plane across the edge stands for the cap.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.dual_grid import CellContext
from dmc_cli.errors import CallError
from dmc_cli.field import CORNERS, EDGES
from dmc_cli.volume import Volume

HALVINGS = 60
"""Steps of the search for a crossing at most; false positions take about ten."""

CLOSE = 1e-12
"""Of an edge: nearer than that a crossing need not be."""

LOW = np.array([CORNERS[a] for a, _ in EDGES])
ACROSS = np.array([CORNERS[b] for _, b in EDGES]) - LOW
"""The lower corner of each edge, and the step from it to the other."""


@dataclass(frozen=True)
class HermiteData:
    """Where the edges of cells are crossed, (n, 12), below 0 where not; the unit normals there, (n, 12, 3).

    Normals are those of the surface in node indices; 0 where there is none.
    """

    crossings: Float64Array
    normals: Float64Array


def hermite_data(cells: Any, crossings: Float64Array, context: CellContext) -> HermiteData:
    """Return the exact crossings and normals of cells by their numbers, (n,).

    Args:
        cells: Numbers of the cells, (n,).
        crossings: Where the linear interpolant crosses each edge, (n, 12), below 0 where it does not.
        context: The volume, which knows its gradient, and its grid.

    Raises:
        CallError: A function of the volume returns something else than numbers of the right shape.
    """
    grid, volume = context.grid, context.volume.volume
    lowest = np.stack(grid.lowest_nodes(cells), axis=1) - grid.border  # in nodes of the volume
    nodes = lowest[:, None] + LOW
    is_crossed, last = crossings >= 0, np.array(volume.shape) - 1
    is_real = ((nodes >= 0) & (nodes + ACROSS <= last)).all(axis=2)
    normals = np.where(is_crossed[..., None], ACROSS, 0).astype(np.float64)
    asked = is_crossed & is_real
    edges = _Edges(
        volume,
        nodes[asked],
        np.broadcast_to(ACROSS, nodes.shape)[asked],
        np.broadcast_to(lowest[:, None, 2], asked.shape)[asked],
    )
    found = crossings.copy()
    if volume.formula is not None:
        level = volume.slope * context.field.isovalue + volume.intercept
        found[asked] = edges.crossings(found[asked], level)
    normals[asked] = edges.gradients(found[asked])
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    return HermiteData(found, normals / np.where(length > 0, length, 1.0))


@dataclass(frozen=True)
class _Edges:
    """Grid edges of a volume: lower nodes, steps to the upper ones, layers of the cells that they are of."""

    volume: Volume
    node: Any
    across: Any
    layer: Any

    def points(self, t: Float64Array) -> Float64Array:
        """Return the points at t along the edges in millimetres, (N, 3)."""
        index = self.node + t[:, None] * self.across
        below, depth = self._depths()
        index[:, 2] = depth + (index[:, 2] - below) * self._steps()
        return np.asarray(index @ self.volume.affine[:3, :3].T + self.volume.affine[:3, 3])

    def _depths(self) -> tuple[Any, Any]:
        """Return the layers' lower slices, and where these lie in steps of even slices."""
        positions = self.volume.slice_positions
        if positions is None:
            return 0, 0
        below = np.clip(self.layer, 0, len(positions) - 2)
        return below, positions[below] / self.volume.spacing[2]

    def _steps(self) -> Any:
        """Return the distance of the slices of each layer, in steps of even slices."""
        positions = self.volume.slice_positions
        if positions is None:
            return 1.0
        below = np.clip(self.layer, 0, len(positions) - 2)
        return (positions[below + 1] - positions[below]) / self.volume.spacing[2]

    def crossings(self, start: Float64Array, level: float) -> Float64Array:
        """Return where the formula crosses a level, by false positions; the start if its ends do not differ.

        After a step that moves the same end again the other end counts half (the Illinois rule).
        """
        low, high = np.zeros(len(start)), np.ones(len(start))
        f_low, f_high = self._values(low, level), self._values(high, level)
        differs = (f_low >= 0) != (f_high >= 0)
        t = np.where(differs, start, 0.5)
        for _ in range(HALVINGS):
            f = self._values(t, level)
            is_low = (f >= 0) == (f_low >= 0)
            f_high = np.where(is_low, 0.5 * f_high, f)
            f_low = np.where(is_low, f, 0.5 * f_low)
            low, high = np.where(is_low, t, low), np.where(is_low, high, t)
            with np.errstate(all="ignore"):
                following = low - f_low * (high - low) / (f_high - f_low)
            is_within = (following >= low) & (following <= high)
            following = np.where(is_within, following, 0.5 * (low + high))
            is_done = np.abs(following - t) <= CLOSE
            t = following
            if (is_done | ~differs).all():
                break
        return np.where(differs, t, start)

    def _values(self, t: Float64Array, level: float) -> Float64Array:
        """Return the formula's values less the level at t along the edges, (N,)."""
        assert self.volume.formula is not None
        return _numbers("formula", self.volume.formula(self.points(t)), (len(t),)) - level

    def gradients(self, t: Float64Array) -> Float64Array:
        """Return the gradients at t along the edges, (N, 3), per step of an index, up to their sizes.

        What is no number is 0.
        """
        assert self.volume.gradient is not None
        told = _numbers("gradient", self.volume.gradient(self.points(t)), (len(t), 3))
        told[~np.isfinite(told).all(axis=1)] = 0.0
        largest = np.abs(told).max(axis=1, keepdims=True, initial=0.0)
        linear = self.volume.affine[:3, :3]
        found = (told / np.where(largest > 0, largest, 1.0)) @ (linear / np.abs(linear).max())
        found[:, 2] *= self._steps()
        return np.asarray(found)


def _numbers(name: str, told: Any, shape: tuple[int, ...]) -> Float64Array:
    """Return what a function of a volume has returned as float64.

    Raises:
        CallError: It is something else than real numbers of that shape.
    """
    array = np.asarray(told)
    if array.shape != shape or array.dtype.kind not in "fiu":
        raise CallError(
            f"the volume's {name} returned {array.dtype} of shape {array.shape} for {shape[0]} points;"
            f" expected real numbers of shape {shape}; change the function"
        )
    return array.astype(np.float64)
