"""The grid that is cut: distances to the isovalue, inside bits, and the nodes that hold data.

With an open border it is the volume's own grid. With a closed border one layer of nodes surrounds
it that never belongs to the object, and nodes without data become such nodes too.
"""

from dataclasses import dataclass

import numpy as np

from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.oracle.cube import CORNERS
from tests.oracle.inside import distances, has_data, next_lower_distance, stored_isovalue


@dataclass(frozen=True)
class Grid:
    """Nodes as [k, j, i]: `distance` float64 (>= 0 inside), `data` bool; `padded` if closed."""

    distance: np.ndarray
    data: np.ndarray
    padded: bool

    @property
    def inside(self) -> np.ndarray:
        """Inside bit of every node; a node without data has none set."""
        with np.errstate(invalid="ignore"):
            return (self.distance >= 0) & self.data

    @property
    def cell_shape(self) -> tuple[int, int, int]:
        """Number of cells along x, y, z."""
        nz, ny, nx = self.distance.shape
        return nx - 1, ny - 1, nz - 1

    def corner_planes(self, nodes: np.ndarray) -> list[np.ndarray]:
        """For each corner the array of its value over all cells, [k, j, i]."""
        nx, ny, nz = self.cell_shape
        return [nodes[c:][:nz, b:][:, :ny, a:][:, :, :nx] for a, b, c in CORNERS]

    def existing_cells(self) -> np.ndarray:
        """Whether all eight corners of each cell hold data, [k, j, i]."""
        return np.all(self.corner_planes(self.data), axis=0)

    def cases(self) -> np.ndarray:
        """The 8-bit case of each cell, [k, j, i]: bit c is set where corner c is inside."""
        planes = self.corner_planes(self.inside.astype(np.int64))
        return sum(plane << c for c, plane in enumerate(planes))

    def linear_index(self, cell: tuple[int, int, int]) -> int:
        """Linear index of a cell's lowest node, x fastest."""
        _, ny, nx = self.distance.shape
        return cell[0] + nx * (cell[1] + ny * cell[2])


def cut_grid(volume: Volume, settings: SurfaceSettings) -> Grid:
    """The grid of a volume under the settings' isovalue, border and inside."""
    dtype = volume.values.dtype
    stored = stored_isovalue(dtype, settings.isovalue, volume.slope, volume.intercept)
    data = has_data(volume.values, volume.padding)
    with np.errstate(invalid="ignore"):
        distance = distances(volume.values, stored, volume.slope)
    if settings.border == "open":
        return Grid(distance, data, padded=False)
    step = next_lower_distance(dtype, stored, volume.slope)
    return close_border(distance, data, step, object_is_inside=settings.inside == "above")


def close_border(
    distance: np.ndarray, data: np.ndarray, next_lower: float, *, object_is_inside: bool
) -> Grid:
    """Surround the grid with one layer of nodes off the object; nodes without data join them.

    A node of the layer is as far from the isovalue as the node nearest to it, on the side that is
    not the object; a node without data lies at the end of the value range on that side.
    """

    def off_object(distance: np.ndarray) -> np.ndarray:
        if not object_is_inside:
            return np.abs(distance)
        return np.where(distance == 0, next_lower, -np.abs(distance))

    filled = distance.copy()
    if data.any():
        end = distance[data].min() if object_is_inside else distance[data].max()
        filled[~data] = off_object(end)
    else:
        filled[:] = off_object(np.ones(1))
    padded = off_object(np.pad(filled, 1, mode="edge"))
    padded[1:-1, 1:-1, 1:-1] = filled
    return Grid(padded, np.ones(padded.shape, dtype=bool), padded=True)
