"""Extract the dual of the grid: the stages in order, with a method's own way to place its vertices.

A stage may end with a launch only begun (`Device.begin`), which the next stage's first launch waits for, so
that threads are at work while the host gets ready.
"""

from dataclasses import dataclass
from typing import Any, Protocol

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.dual_grid.active_cells import ActiveCells, find_active, list_active
from dmc_cli.contouring.dual_grid.cell_quads import connect_cells
from dmc_cli.contouring.stages.classification import InsideBits, find_inside
from dmc_cli.contouring.stages.numbering import QuadNumbering
from dmc_cli.contouring.stages.outcome import faces_reversed, field_of, refuse_infinite
from dmc_cli.contouring.surface import Reserve, Surface, SurfaceCounts
from dmc_cli.field import (
    DeviceVolume,
    GridShape,
    grid_affine,
    grid_of,
    is_mirrored,
    kernel_matrix,
    map_vertices,
    slice_depths,
)
from dmc_cli.mesh import Mesh, Placement, SurfaceFrame
from dmc_cli.runtime import Device
from dmc_cli.settings import SurfaceSettings


@dataclass(frozen=True)
class CellContext:
    """What a placement may look at.

    Attributes:
        field: The kernels' `Field`.
        grid: The grid over the volume.
        matrix: The kernels' map of the grid's node index to the output space, slices even.
        device: Where to work.
        volume: The volume itself.
        settings: Isovalue, side, and what the method takes.
    """

    field: Any
    grid: GridShape
    matrix: Any
    device: Device
    volume: DeviceVolume
    settings: SurfaceSettings


@dataclass(frozen=True)
class CellVertices:
    """Where the vertices of cells lie.

    Attributes:
        position: float32 vec3 (V,), in the output space with even slices.
        local: float32 vec3 (V,), local coordinates in [0, 1].
        fallbacks: Vertices that a placement put elsewhere than where its rule leads; None if it has none.
    """

    position: Any
    local: Any
    fallbacks: int | None = None


class PlaceCells(Protocol):
    """A way to place one vertex in each of many cells."""

    def __call__(self, cell: Any, context: CellContext) -> CellVertices:
        """Place the vertices of cells by their numbers, int64 (V,); the last launch may be begun only."""


def extract_dual(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None,
    even_slices: bool,
    reserve: Reserve | None,
    place: PlaceCells,
) -> Surface:
    """Extract the isosurface as the dual of the grid; the arguments are those of `extract_surface`."""
    device = volume.device
    grid = grid_of(volume.volume.shape, border=int(settings.border == "closed"))
    nodes = find_inside(volume, settings, grid)
    field = field_of(volume, settings, nodes)
    found = find_active(nodes, grid, device)
    target = volume.volume.affine if affine is None else affine
    is_reversed = faces_reversed(settings, target)
    to_output = grid_affine(target, grid)
    matrix = kernel_matrix(to_output)
    depths = slice_depths(None if even_slices else volume.volume, grid, device)
    if reserve is not None:
        (_, vertex_count), (_, quad_count) = found.starts
        reserve(vertex_count, quad_count, near=found.words_near(grid, device), cells=0)
    cells = list_active(found, grid, device)
    vertices = place(cells.cell, CellContext(field, grid, matrix, device, volume, settings))
    position = vertices.position
    if depths.shape[0]:
        position = map_vertices(cells.cell, vertices.local, depths, grid, matrix, device)
    quads = connect_cells(cells, grid, is_reversed, device)
    refuse_infinite(position, to_output, grid, depths)
    sense = 1.0 if is_reversed != is_mirrored(to_output) else -1.0
    frame = SurfaceFrame(field, grid, to_output, depths, sense, device)
    return Surface(
        mesh=Mesh(position, quads, device),
        placement=Placement(cells.cell, vertices.local, frame),
        counts=_counts(nodes, cells, vertices),
        method=settings.method,
        numbering=QuadNumbering(cells, cells.quad_starts, cells.quad_count, is_reversed),
    )


def _counts(nodes: InsideBits, cells: ActiveCells, vertices: CellVertices) -> SurfaceCounts:
    """Gather what the stages counted."""
    return SurfaceCounts(
        unused_vertices=cells.active_count - cells.count,
        crossed_edges=cells.crossed_edges,
        active_cells=cells.active_count,
        fallback_vertices=vertices.fallbacks,
        no_data_nodes=nodes.no_data_count,
    )
