"""Extract vertices and triangles: the shared stages for most cells, this folder's for special ones.

Vertices on edges come first, then inner ones in grid order of their cells, at last those of second fans.
Triangles of cells that the tables of cases serve come first, then those of special cells, in grid order each.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.stages.edge_surface import EdgeStages, find_edges
from dmc_cli.contouring.stages.edge_vertices import EdgeVertices
from dmc_cli.contouring.stages.second_fans import RowFaces
from dmc_cli.contouring.surface import Reserve, Surface, SurfaceCounts
from dmc_cli.contouring.topological_marching_cubes.trilinear_cells import (
    TALLIES,
    connect_cells_kernel,
    count_cells_kernel,
)
from dmc_cli.field import DeviceVolume
from dmc_cli.runtime import ITEMS_A_CHUNK, mesh_size
from dmc_cli.settings import SurfaceSettings


@dataclass(frozen=True)
class SpecialCounts:
    """What the special cells have.

    Attributes:
        triangle_starts: Their triangles before each, int64.
        inner_starts: Their inner vertices before each, int64.
        triangles: All their triangles.
        inner: All their inner vertices.
        tallies: Their polygons, how many have several, ambiguous faces, tunnels.
    """

    triangle_starts: Any
    inner_starts: Any
    triangles: int
    inner: int
    tallies: list[int]


def extract(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None,
    even_slices: bool,
    reserve: Reserve | None,
) -> Surface:
    """Extract the isosurface as triangles; the arguments are those of `extract_surface`.

    The last launch may be begun only.

    Raises:
        DeviceError: More vertices or triangles than 32-bit mesh indices can number.
    """
    stages = find_edges(volume, settings, affine, even_slices, serves_special=False)
    ranks = stages.ranks
    special = _count(stages)
    vertex_count = mesh_size(stages.vertex_count + special.inner)
    triangle_count = mesh_size(ranks.triangle_count + special.triangles)
    if reserve is not None:
        reserve(vertex_count, triangle_count, cells=ranks.special_count)
    vertices = stages.place_vertices(others=special.inner)
    faces = stages.connect(vertices, others=special.triangles)
    _connect(stages, special, vertices, faces)
    polygons, several, ambiguous, tunnels = special.tallies
    counts = SurfaceCounts(
        polygons=ranks.active_cells - ranks.special_count + polygons,
        crossed_edges=ranks.vertex_count,
        active_cells=ranks.active_cells,
        multi_polygon_cells=several,
        ambiguous_faces=ambiguous,
        tunnel_cells=tunnels,
        no_data_nodes=stages.no_data_nodes,
    )
    rows = RowFaces(ranks.special_starts, special.triangle_starts, ranks.triangle_count)
    return stages.finished(vertices, faces, counts, rows if ranks.special_count else None)


def _inputs(stages: EdgeStages) -> list[Any]:
    """Return what both kernels take first."""
    special, ranks = stages.special, stages.ranks
    grid = [stages.grid.struct(), stages.field, ranks.bits, ranks.rows]
    return [*grid, special.row, special.i, stages.tables, stages.true_depths, int(stages.is_best)]


def tally_cells(stages: EdgeStages) -> tuple[Any, Any]:
    """Return triangles and inner vertices of special cells, int64 (2, n), and their tallies, uint8 (4, n)."""
    device, count = stages.device, stages.ranks.special_count
    counts = device.empty((2, count), wp.int64)
    tallies = device.empty((TALLIES, count), wp.uint8)
    if count:
        none = [device.empty(0, wp.vec4i), device.empty(0, wp.vec3)]
        inputs = [*_inputs(stages), *none]
        device.launch(count_cells_kernel, count, inputs, [counts, tallies], ITEMS_A_CHUNK)
    return counts, tallies


def _count(stages: EdgeStages) -> SpecialCounts:
    """Count what the special cells have."""
    device = stages.device
    counts, tallies = tally_cells(stages)
    if stages.ranks.special_count == 0:
        nothing = device.empty(0, wp.int64)
        return SpecialCounts(nothing, nothing, 0, 0, [0] * TALLIES)
    (triangle_starts, triangles), (inner_starts, inner) = device.starts_of_rows(counts)
    return SpecialCounts(triangle_starts, inner_starts, triangles, inner, device.totals(tallies))


def _connect(stages: EdgeStages, special: SpecialCounts, vertices: EdgeVertices, faces: Any) -> None:
    """Begin to write down the triangles and inner vertices of special cells."""
    ranks = stages.ranks
    if ranks.special_count == 0:
        return
    starts = [special.triangle_starts, special.inner_starts, ranks.triangle_count, ranks.vertex_count]
    inputs = [*_inputs(stages), int(stages.is_reversed), stages.matrix, *starts]
    outputs = [faces, vertices.position, vertices.cell, vertices.local]
    stages.device.begin(connect_cells_kernel, ranks.special_count, inputs, outputs, ITEMS_A_CHUNK)
