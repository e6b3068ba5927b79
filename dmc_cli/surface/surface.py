"""From a volume to vertices and quads: the stages of this folder in the order they run.

A stage may end with a launch only begun (`Device.begin`), which the next stage's first launch waits for, so
that threads are at work while the host gets ready.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.device import Device
from dmc_cli.errors import VolumeError
from dmc_cli.settings import SurfaceSettings
from dmc_cli.surface.cells import Cells, find_cells, words_near_quads
from dmc_cli.surface.field import DeviceVolume, absent_value, make_field
from dmc_cli.surface.grid import GridShape, grid_affine, grid_of, is_mirrored, kernel_matrix
from dmc_cli.surface.inside import InsideBits, find_inside
from dmc_cli.surface.polygons import Polygons, Tallies, trace_polygons
from dmc_cli.surface.quads import connect_quads
from dmc_cli.surface.slices import map_vertices, slice_depths
from dmc_cli.surface.vertices import Vertices, count_fallbacks, place_vertices
from dmc_cli.volume.checks import FARTHEST_MM
from dmc_cli.volume.mapping import intact


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
    cells: Cells | None
    polygons: Polygons | None
    stored_isovalue: float
    affine: np.ndarray[Any, Any]
    depths: Any
    device: Device

    @property
    def sense(self) -> float:
        """1 if quads face along the gradient of F in the output space, else -1."""
        return 1.0 if self.is_reversed != is_mirrored(self.affine) else -1.0


def extract_surface(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: np.ndarray[Any, Any] | None = None,
    *,
    even_slices: bool = False,
    reserve: Callable[[int, int], None] | None = None,
    reserve_tracing: Callable[[int | None, int, int, int], None] | None = None,
) -> Surface:
    """Extract the isosurface of a volume as quads.

    Args:
        volume: Values on the device.
        settings: Isovalue, side, topology, border, orientation.
        affine: Shape (4, 4): node index to the space that vertices are wanted in; the volume's own if None.
        even_slices: Leave slice positions aside, as grid coordinates do.
        reserve: Called with the numbers of vertices and quads, of quads at most that many where nodes are
            without data, before memory for them is taken; it may raise.
        reserve_tracing: Called before special cells are traced, with the numbers of words that
            `words_near_quads` tells, of ordinary and special cells, and of quads; it may raise as well.

    Raises:
        DeviceError: More vertices or quads than 32-bit mesh indices can number.
        DamagedVolumeError: The file that holds the values shrank meanwhile.
    """
    device = volume.device
    device.wake()
    with intact(volume.volume.values, volume.volume.path):
        try:
            surface = _run_stages(volume, settings, affine, even_slices, reserve, reserve_tracing)
        except BaseException:
            device.drop()
            raise
        device.finish()
    return surface


def _run_stages(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: np.ndarray[Any, Any] | None,
    even_slices: bool,
    reserve: Callable[[int, int], None] | None,
    reserve_tracing: Callable[[int | None, int, int, int], None] | None,
) -> Surface:
    """Extract the isosurface; the last launch may be begun only."""
    device = volume.device
    grid = grid_of(volume.volume.shape, border=int(settings.border == "closed"))
    nodes = find_inside(volume, settings, grid)
    field = _field(volume, settings, nodes)
    cells = find_cells(nodes, grid, device)
    target = volume.volume.affine if affine is None else affine
    is_reversed = _is_reversed(settings, target)
    to_output = grid_affine(target, grid)
    matrix = kernel_matrix(to_output)
    depths = slice_depths(None if even_slices else volume.volume, grid, device)
    if reserve_tracing is not None:
        near = words_near_quads(cells, grid, device)
        reserve_tracing(near, cells.ordinary_count, cells.special_count, cells.quad_count)
    polygons, tallies = trace_polygons(cells, field, grid, settings.topology == "manifold", device)
    if reserve is not None:
        reserve(polygons.vertex_count, cells.quad_count)
    vertices = place_vertices(cells, polygons, field, grid, matrix, device, settings.placement)
    position = vertices.position
    if depths.shape[0]:
        position = map_vertices(vertices.cell, vertices.local, depths, grid, matrix, device)
    quads = connect_quads(cells, polygons, grid, is_reversed, device)
    _refuse_infinite(position, to_output, grid, depths)
    return Surface(
        vertices=position,
        vertex_cell=vertices.cell,
        vertex_local=vertices.local,
        quads=quads.corners,
        quad_starts=quads.starts,
        is_reversed=is_reversed,
        counts=_counts(nodes, cells, tallies, vertices, device),
        field=field,
        grid=grid,
        cells=cells,
        polygons=polygons,
        stored_isovalue=field.isovalue,
        affine=to_output,
        depths=depths,
        device=device,
    )


def _field(volume: DeviceVolume, settings: SurfaceSettings, nodes: InsideBits) -> Any:
    """Return the kernels' `Field`, which looks for nodes without data only where there are any."""
    field = make_field(volume, settings)
    if nodes.no_data_count:
        field.has_absent = 1
        field.absent = absent_value(volume.volume, field)
    return field


def _counts(
    nodes: InsideBits, cells: Cells, tallies: Tallies, vertices: Vertices, device: Device
) -> SurfaceCounts:
    """Gather what the stages counted."""
    polygons, unused, multi, ambiguous = device.totals(tallies.cells)
    return SurfaceCounts(
        polygons=cells.ordinary_count + polygons,
        unused_vertices=unused,
        crossed_edges=cells.crossed_edges,
        active_cells=cells.ordinary_count + cells.special_count,
        multi_polygon_cells=multi,
        ambiguous_faces=ambiguous,
        flipped_faces=tallies.flipped_faces,
        fallback_vertices=count_fallbacks(vertices, device),
        no_data_nodes=nodes.no_data_count,
    )


def _refuse_infinite(position: Any, to_output: np.ndarray[Any, Any], grid: GridShape, depths: Any) -> None:
    """Raise VolumeError if a position is beyond float32; positions are only looked at where one may be."""
    rows = to_output[:3].tolist()
    deepest = np.abs(depths.numpy()).max(initial=grid.nz)
    sizes = (grid.nx, grid.ny, float(deepest), 1)
    farthest = max(sum(abs(a) * n for a, n in zip(row, sizes, strict=True)) for row in rows)
    if farthest < FARTHEST_MM or np.isfinite(position.numpy()).all():
        return
    raise VolumeError(
        f"the volume reaches as far as {farthest:g} mm; expected coordinates that float32 holds, up to"
        f" {FARTHEST_MM:.2g}; move its origin, or write grid coordinates with --space voxel"
    )


def _is_reversed(settings: SurfaceSettings, affine: np.ndarray[Any, Any]) -> bool:
    """Return whether quads made for a right-handed grid, normals towards lower values, must be reversed."""
    towards_higher = settings.orientation == "gradient" or settings.inside == "below"
    return towards_higher != is_mirrored(affine)
