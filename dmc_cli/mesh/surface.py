"""The result of contouring: a mesh that still knows the field that it was cut from."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.field.grid import GridShape, is_mirrored
from dmc_cli.runtime.device import Device


@dataclass(frozen=True)
class SurfaceCounts:
    """What was found on the way; the keys of the report's `surface` section.

    `polygons` counts every MC polygon of every cell, `unused_vertices` those without a quad, which give no
    vertex; with manifold topology an open border may turn one polygon into several vertices.
    """

    polygons: int
    unused_vertices: int
    crossed_edges: int
    active_cells: int
    multi_polygon_cells: int
    ambiguous_faces: int
    flipped_faces: int
    fallback_vertices: int
    no_data_nodes: int


@dataclass(frozen=True)
class Surface:
    """A quad mesh that still knows its grid.

    Attributes:
        vertices: float32 vec3 (V,), millimetres in the output space.
        vertex_cell: int64 (V,), linear number of the cell's lowest node in the grid, x fastest.
        vertex_local: float32 vec3 (V,), coordinates in the cell, in [0, 1].
        quads: int32 vec4 (Q,), vertex numbers, counter-clockwise seen from where the normal points.
        quad_starts: Quads before each block of words (`words.py`), int64, one item more than blocks.
        is_reversed: Whether normals point towards the inside nodes.
        counts: What was found on the way.
        field: The kernels' `Field`: F at the grid's nodes.
        grid: The grid, with the virtual border if closed.
        cells: Active cells and their numbering; None once nothing looks for them any more.
        polygons: The special cells' polygons; None likewise.
        stored_isovalue: The level that was cut, in stored values.
        affine: Shape (4, 4): the grid's node index, slices even, to the output space.
        depths: Depths of unevenly spaced slices, float64 (nz,), as `slice_depths` returns them; else empty.
        device: Where the arrays are.
    """

    vertices: Any
    vertex_cell: Any
    vertex_local: Any
    quads: Any
    quad_starts: Any
    is_reversed: bool
    counts: SurfaceCounts
    field: Any
    grid: GridShape
    cells: Any
    polygons: Any
    stored_isovalue: float
    affine: np.ndarray[Any, Any]
    depths: Any
    device: Device

    @property
    def sense(self) -> float:
        """1 if quads face along the gradient of F in the output space, else -1."""
        return 1.0 if self.is_reversed != is_mirrored(self.affine) else -1.0
