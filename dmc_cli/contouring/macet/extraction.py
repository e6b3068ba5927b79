"""Extract vertices and triangles: the shared stages, and the moves of the vertices between them."""

from typing import Any

import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.macet.edge_guard import EdgeGuard
from dmc_cli.contouring.macet.moved_triangles import connect_moved_kernel
from dmc_cli.contouring.macet.smoothing import sum_neighbors_kernel
from dmc_cli.contouring.macet.surface_steps import FAR, NEAR, make_steps, settle_rows_kernel
from dmc_cli.contouring.stages.cell_triangles import make_tables
from dmc_cli.contouring.stages.edge_surface import EdgeStages, find_edges
from dmc_cli.contouring.stages.edge_vertices import EdgeVertices
from dmc_cli.contouring.stages.special_list import count_special
from dmc_cli.contouring.surface import Reserve, Surface, SurfaceCounts
from dmc_cli.field import DeviceVolume
from dmc_cli.runtime import view
from dmc_cli.settings import SurfaceSettings


def extract(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None,
    even_slices: bool,
    reserve: Reserve | None,
) -> Surface:
    """Extract the isosurface as triangles; the arguments are those of `extract_surface`."""
    stages = find_edges(volume, settings, affine, even_slices, serves_special=True)
    ranks, polygon_count = stages.ranks, stages.tables.polygon_count
    if reserve is not None:
        reserve(stages.vertex_count, ranks.triangle_count, cells=ranks.special_count)
    vertices = stages.place_vertices()
    polygons, several, ambiguous = count_special(
        ranks, stages.special, polygon_count, stages.grid, stages.device
    )
    moves = Moves(stages, vertices, volume.volume.affine)
    drawn = 0
    if ranks.vertex_count:
        moves.settle()
        moves.smooth()
        drawn = moves.guard()
    counts = SurfaceCounts(
        polygons=ranks.active_cells - ranks.special_count + polygons,
        crossed_edges=ranks.vertex_count,
        active_cells=ranks.active_cells,
        multi_polygon_cells=several,
        ambiguous_faces=ambiguous,
        fallback_vertices=drawn,
        no_data_nodes=stages.no_data_nodes,
    )
    return stages.finished(vertices, moves.faces, counts)


class Moves:
    """Moves the vertices of a mesh, and triangulates polygons anew: in the order of the methods.

    Attributes:
        steps: The kernels' `Steps`.
        faces: The triangles, int32 vec4 (T,).
    """

    def __init__(self, stages: EdgeStages, vertices: EdgeVertices, affine: Float64Array) -> None:
        """Begin with vertices at the crossings of their edges; triangles are judged by `affine`, (4, 4)."""
        self._stages, self._device, self._affine = stages, stages.device, affine
        self._tables = make_tables(affine, self._device, serves_special=True, from_middles=True)
        self.steps = make_steps(vertices, stages.ranks.vertex_count, self._device)
        self.faces = self._device.empty(stages.ranks.triangle_count, wp.vec4i)
        self._poor = self._device.empty(stages.grid.rows, wp.uint8)
        self._threads = -(-stages.grid.rows // self._device.span)
        self._ends = [stages.grid.rows, self._device.span]

    def settle(self) -> None:
        """Move the edges' middles to the surface, and connect them."""
        self._settle(NEAR, self._device.empty(0, wp.vec4))

    def smooth(self) -> None:
        """Move the vertices towards their neighbours, once, and triangulate anew."""
        ranks, sums = self._stages.ranks, self._device.empty(self._stages.ranks.vertex_count, wp.vec4)
        inputs = [self._stages.grid.struct(), ranks.bits, ranks.triangle_starts, self.faces, *self._ends]
        inputs.append(self.steps.position)
        self._device.launch(sum_neighbors_kernel, self._threads, inputs, [sums], 1)
        self._settle(FAR, sums)

    def guard(self) -> int:
        """Draw vertices back from bad triangles, as these lie in the world; return how many."""
        guard = EdgeGuard(self._stages, self._affine)
        while (beside := guard.draw_back(self.faces, self.steps, self._poor)).shape[0]:
            self._connect(beside)
        return guard.drawn

    def _settle(self, reach: float, sums: Any) -> None:
        stages = self._stages
        inputs = [stages.grid.struct(), stages.field, stages.ranks.bits, stages.matrix, *self._ends]
        self._device.begin(settle_rows_kernel, self._threads, [*inputs, reach, sums], [self.steps], 1)
        self._connect(self._device.empty(0, wp.int32))

    def _connect(self, listed: Any) -> None:
        """Begin to triangulate the polygons of listed rows, or all, as well as can be."""
        stages, ranks = self._stages, self._stages.ranks
        steps = view(self.steps.step, wp.float32, 3 * self.steps.step.shape[0])
        inputs = [stages.grid.struct(), ranks.bits, ranks.triangle_starts, stages.true_depths, steps]
        inputs += [self._tables, int(stages.is_reversed), listed, *self._ends]
        threads = listed.shape[0] or self._threads
        self._device.begin(connect_moved_kernel, threads, inputs, [self.faces, self._poor], 1)
