"""Number the nodes, cells, edges and faces of the grid, and place one bit per node.

Conventions, used by every stage:

    Corner c of a cell sits at (c & 1, c >> 1 & 1, c >> 2).
    Edges e0 to e11 join corners 01 13 23 02 45 57 67 46 04 15 37 26 (Grosso & Zint 2021, figure 1).
    Face 2a + s is the face at side s (0 low, 1 high) of axis a (0 x, 1 y, 2 z).

             6-----e6------7
            /|            /|        w
           e7|          e5 |        |  v
          /  e11        /  e10      | /
         4-----e4------5   |        |/
         |   |         |   |        +---- u
         |   2-----e2--|---3
        e8  /         e9  /
         | e3          | e1
         |/            |/
         0-----e0------1

A row is a line of nodes along x; row r of a grid with ny rows a layer is at j = r % ny, k = r // ny.
Bits are stored by row, 32 nodes a word: bit b of word w belongs to node i = 32 w + b. A bit of a cell
is stored at its lowest node. Word w of row r is word r * words + w of one long line (`planes.py`). With a
closed border the grid has one more layer of nodes on every side than the volume; its node (1, 1, 1) is
then the volume's first.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.kept_property import kept_property

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

CORNERS = tuple((c & 1, c >> 1 & 1, c >> 2) for c in range(8))
"""Offset of each corner of a cell from its lowest node."""

EDGES = ((0, 1), (1, 3), (2, 3), (0, 2), (4, 5), (5, 7), (6, 7), (4, 6), (0, 4), (1, 5), (3, 7), (2, 6))
"""The two corners of each edge, the lower one first."""


@wp.struct
class Grid:
    """Nodes along each axis, words a row and a layer, and how many layers lie outside the volume."""

    nx: wp.int32
    ny: wp.int32
    nz: wp.int32
    words: wp.int32
    layer: wp.int32  # words a layer of rows
    border: wp.int32  # layers of virtual nodes on every side: 0 open, 1 closed


@dataclass(frozen=True)
class GridShape:
    """The host's view of a `Grid`."""

    nx: int
    ny: int
    nz: int
    border: int

    @property
    def words(self) -> int:
        """Return the words of bits per row."""
        return -(-self.nx // 32)

    @property
    def rows(self) -> int:
        """Return the number of rows of nodes."""
        return self.ny * self.nz

    @property
    def layer(self) -> int:
        """Return the words of bits per layer of rows."""
        return self.ny * self.words

    def lowest_nodes(self, cells: Any) -> tuple[Any, Any, Any]:
        """Return i, j and k of the lowest nodes of cells by their numbers, on the host, int64 (V,) each."""
        rows = cells // self.nx
        return cells % self.nx, rows % self.ny, rows // self.ny

    def struct(self) -> Any:
        """Return the grid as kernels take it, a `Grid`."""
        return self._struct

    @kept_property
    def _struct(self) -> Any:
        grid = Grid()
        grid.nx, grid.ny, grid.nz = self.nx, self.ny, self.nz
        grid.words, grid.layer, grid.border = self.words, self.layer, self.border
        return grid


def grid_of(volume_shape: tuple[int, int, int], border: int) -> GridShape:
    """Return the grid over a volume of (nx, ny, nz) nodes with `border` virtual layers on every side."""
    nx, ny, nz = (n + 2 * border for n in volume_shape)
    return GridShape(nx, ny, nz, border)


def grid_affine(affine: Float64Array, grid: GridShape) -> Float64Array:
    """Return the affine, (4, 4), of the grid's node indices, virtual layers counted, from the volume's."""
    shifted = np.array(affine, dtype=np.float64)
    if grid.border:
        shifted[:3, 3] -= grid.border * shifted[:3, :3].sum(axis=1)
    return shifted


def kernel_matrix(affine: Float64Array) -> Any:
    """Return an affine, (4, 4), as kernels take it, mat44d."""
    return wp.mat44d(*affine.ravel().tolist())


def is_mirrored(affine: Float64Array) -> bool:
    """Return whether an affine, (4, 4), mirrors: its determinant is negative."""
    (a, b, c), (d, e, f), (g, h, i) = affine[:3, :3].tolist()
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return bool(determinant < 0)


@wp.func
def world_coordinate(
    a: wp.float64, b: wp.float64, c: wp.float64, d: wp.float64, x: wp.float64, y: wp.float64, z: wp.float64
) -> wp.float32:
    """Return one world coordinate in double precision, rounded once: a row of an affine times a point."""
    return wp.float32(a * x + b * y + c * z + d)


@wp.func
def world_position(m: wp.mat44d, x: wp.vec3d) -> wp.vec3:
    """Map coordinates in node indices, slices even, to the output space; each is rounded once."""
    return wp.vec3(
        world_coordinate(m[0, 0], m[0, 1], m[0, 2], m[0, 3], x[0], x[1], x[2]),
        world_coordinate(m[1, 0], m[1, 1], m[1, 2], m[1, 3], x[0], x[1], x[2]),
        world_coordinate(m[2, 0], m[2, 1], m[2, 2], m[2, 3], x[0], x[1], x[2]),
    )


@wp.func
def row_place(grid: Grid, row: wp.int32) -> wp.vec2i:
    """Return j and k of a row."""
    k = row / grid.ny
    return wp.vec2i(row - k * grid.ny, k)


@wp.func
def cell_node(grid: Grid, cell: wp.int64) -> wp.vec3i:
    """Return the lowest node of a cell by its number."""
    row = wp.int32(cell / wp.int64(grid.nx))
    i = wp.int32(cell - wp.int64(row) * wp.int64(grid.nx))
    place = row_place(grid, row)
    return wp.vec3i(i, place[0], place[1])


@wp.func
def node_cell(grid: Grid, node: wp.vec3i) -> wp.int64:
    """Return the number of the cell with this lowest node."""
    return wp.int64(node[1] + grid.ny * node[2]) * wp.int64(grid.nx) + wp.int64(node[0])


@wp.func
def node_position(node: wp.vec3i, local: wp.vec3) -> wp.vec3d:
    """Return the coordinates, in node indices, of a point of the cell with this lowest node."""
    return wp.vec3d(
        wp.float64(node[0]) + wp.float64(local[0]),
        wp.float64(node[1]) + wp.float64(local[1]),
        wp.float64(node[2]) + wp.float64(local[2]),
    )


@wp.func
def index_position(grid: Grid, cell: wp.int64, local: wp.vec3) -> wp.vec3d:
    """Return the coordinates, in node indices, of a point of a cell by its number."""
    return node_position(cell_node(grid, cell), local)
