"""Extract vertices and triangles: the shared stages in the order they run."""

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.stages.edge_surface import find_edges
from dmc_cli.contouring.stages.special_list import count_special
from dmc_cli.contouring.surface import Reserve, Surface, SurfaceCounts
from dmc_cli.field import DeviceVolume
from dmc_cli.settings import SurfaceSettings


def extract(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None,
    even_slices: bool,
    reserve: Reserve | None,
) -> Surface:
    """Extract the isosurface as triangles; the arguments are those of `extract_surface`.

    The last launch may be begun only.
    """
    stages = find_edges(volume, settings, affine, even_slices, serves_special=True)
    ranks, polygon_count = stages.ranks, stages.tables.polygon_count
    if reserve is not None:
        reserve(stages.vertex_count, ranks.triangle_count, cells=ranks.special_count)
    vertices = stages.place_vertices()
    polygons, several, ambiguous = count_special(
        ranks, stages.special, polygon_count, stages.grid, stages.device
    )
    faces = stages.connect(vertices)
    counts = SurfaceCounts(
        polygons=ranks.active_cells - ranks.special_count + polygons,
        crossed_edges=ranks.vertex_count,
        active_cells=ranks.active_cells,
        multi_polygon_cells=several,
        ambiguous_faces=ambiguous,
        no_data_nodes=stages.no_data_nodes,
    )
    return stages.finished(vertices, faces, counts)
