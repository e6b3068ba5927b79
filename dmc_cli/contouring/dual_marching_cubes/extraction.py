"""Extract vertices and quads: the stages of this folder in the order they run.

A stage may end with a launch only begun (`Device.begin`), which the next stage's first launch waits for, so
that threads are at work while the host gets ready.
"""

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.dual_marching_cubes.cells import Cells, find_cells, words_near_quads
from dmc_cli.contouring.dual_marching_cubes.numbering import Numbering
from dmc_cli.contouring.dual_marching_cubes.polygons import Tallies, trace_polygons
from dmc_cli.contouring.dual_marching_cubes.quads import connect_quads
from dmc_cli.contouring.dual_marching_cubes.vertices import Vertices, count_fallbacks, place_vertices
from dmc_cli.contouring.stages.classification import InsideBits, find_inside
from dmc_cli.contouring.stages.outcome import faces_reversed, field_of, refuse_infinite
from dmc_cli.contouring.surface import Reserve, Surface, SurfaceCounts
from dmc_cli.field import (
    DeviceVolume,
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


def extract(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None,
    even_slices: bool,
    reserve: Reserve | None,
) -> Surface:
    """Extract the isosurface as quads; the arguments are those of `extract_surface`.

    The last launch may be begun only.
    """
    device = volume.device
    grid = grid_of(volume.volume.shape, border=int(settings.border == "closed"))
    nodes = find_inside(volume, settings, grid)
    field = field_of(volume, settings, nodes)
    cells = find_cells(nodes, grid, device)
    target = volume.volume.affine if affine is None else affine
    is_reversed = faces_reversed(settings, target)
    to_output = grid_affine(target, grid)
    matrix = kernel_matrix(to_output)
    depths = slice_depths(None if even_slices else volume.volume, grid, device)
    if reserve is not None:  # each ordinary cell has a vertex
        near = words_near_quads(cells, grid, device)
        reserve(cells.ordinary_count, cells.quad_count, near=near, cells=cells.special_count)
    polygons, tallies = trace_polygons(cells, field, grid, settings.topology == "manifold", device)
    if reserve is not None:
        reserve(polygons.vertex_count, cells.quad_count)
    vertices = place_vertices(cells, polygons, field, grid, matrix, device, settings.placement)
    position = vertices.position
    if depths.shape[0]:
        position = map_vertices(vertices.cell, vertices.local, depths, grid, matrix, device)
    quads = connect_quads(cells, polygons, grid, is_reversed, device)
    refuse_infinite(position, to_output, grid, depths)
    sense = 1.0 if is_reversed != is_mirrored(to_output) else -1.0
    frame = SurfaceFrame(field, grid, to_output, depths, sense, device)
    return Surface(
        mesh=Mesh(position, quads.corners, device),
        placement=Placement(vertices.cell, vertices.local, frame),
        counts=_counts(nodes, cells, tallies, vertices, device),
        method=settings.method,
        numbering=Numbering(cells, quads.starts, quads.corners.shape[0], is_reversed, polygons=polygons),
    )


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
