"""Hold what the stages of a method with vertices on edges share, from inside bits to the finished surface."""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.stages.cell_triangles import connect_triangles, make_tables
from dmc_cli.contouring.stages.classification import find_inside
from dmc_cli.contouring.stages.edge_ranks import EdgeRanks, rank_edges
from dmc_cli.contouring.stages.edge_vertices import EdgeVertices, place_edge_vertices
from dmc_cli.contouring.stages.outcome import faces_reversed, field_of, refuse_infinite
from dmc_cli.contouring.stages.second_fans import (
    RowFaces,
    SecondFans,
    find_second_fans,
    separate_fans,
)
from dmc_cli.contouring.stages.special_list import SpecialList, list_special
from dmc_cli.contouring.surface import Surface, SurfaceCounts
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
from dmc_cli.runtime import Device, mesh_size
from dmc_cli.settings import SurfaceSettings


@dataclass(frozen=True)
class EdgeStages:
    """A volume on its way to a mesh with vertices on crossed edges.

    Attributes:
        settings: What was asked for.
        grid: The grid over the volume.
        field: The kernels' `Field`.
        tables: The kernels' `Tables` of cases.
        ranks: The crossed edges' numbers.
        special: The special cells.
        fans: The vertices that two fans of faces name, beside missing cells.
        affine: Shape (4, 4): the grid's node index, slices even, to the output space.
        depths: Depths of uneven slices in the output space, else empty.
        true_depths: Those of the volume itself, by which triangles are judged.
        is_reversed: Whether normals point towards the inside nodes instead of away from them.
        no_data_nodes: Nodes without data.
        device: Where to work.
    """

    settings: SurfaceSettings
    grid: GridShape
    field: Any
    tables: Any
    ranks: EdgeRanks
    special: SpecialList
    fans: SecondFans
    affine: Float64Array
    depths: Any
    true_depths: Any
    is_reversed: bool
    no_data_nodes: int
    device: Device

    @property
    def matrix(self) -> Any:
        """Return the map to the output space as kernels take it."""
        return kernel_matrix(self.affine)

    @property
    def is_best(self) -> bool:
        """Return whether polygons get the triangles of the best shapes."""
        return self.settings.triangulation == "best"

    @property
    def vertex_count(self) -> int:
        """Return how many vertices there are on edges, second fans' own included.

        Raises:
            DeviceError: More than 32-bit mesh indices can number.
        """
        return mesh_size(self.ranks.vertex_count + self.fans.count)

    def place_vertices(self, others: int = 0) -> EdgeVertices:
        """Place the vertices on edges, with room for others and, behind these, for those of second fans."""
        others += self.fans.count
        return place_edge_vertices(self.ranks, self.field, self.grid, self.matrix, self.device, others=others)

    def connect(self, vertices: EdgeVertices, others: int = 0) -> Any:
        """Begin to connect the triangles that the tables of cases give, with room for others."""
        return connect_triangles(
            self.ranks,
            vertices.crossing,
            self.tables,
            self.true_depths,
            self.grid,
            self.device,
            is_best=self.is_best,
            is_reversed=self.is_reversed,
            others=others,
        )

    def finished(
        self, vertices: EdgeVertices, faces: Any, counts: SurfaceCounts, others: RowFaces | None = None
    ) -> Surface:
        """Return the surface of these vertices and faces; the last launch may be begun only.

        Args:
            vertices: The vertices; those of second fans are still to be copied.
            faces: The triangles, int32 vec4.
            counts: What the report tells.
            others: Where the triangles are that the tables of cases do not give.

        Raises:
            VolumeError: A position is beyond float32.
        """
        served = RowFaces(self.ranks.triangle_starts, self.device.empty(0, wp.int64))
        points = (vertices.position, vertices.cell, vertices.local)
        separate_fans(self.fans, points, faces, [served, *([others] if others else [])], self.device)
        position, device = vertices.position, self.device
        if self.depths.shape[0]:
            position = map_vertices(
                vertices.cell, vertices.local, self.depths, self.grid, self.matrix, device
            )
        refuse_infinite(position, self.affine, self.grid, self.depths)
        sense = 1.0 if self.is_reversed != is_mirrored(self.affine) else -1.0
        frame = SurfaceFrame(self.field, self.grid, self.affine, self.depths, sense, device)
        return Surface(
            mesh=Mesh(position, faces, device, triangle_count=faces.shape[0]),
            placement=Placement(vertices.cell, vertices.local, frame),
            counts=counts,
            method=self.settings.method,
        )


def find_edges(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None,
    even_slices: bool,
    *,
    serves_special: bool,
) -> EdgeStages:
    """Find the crossed edges, count the triangles, and begin to list the special cells.

    The first arguments are those of `extract_surface`; `serves_special` says whether the tables of cases give
    the triangles of special cells, too.
    """
    device = volume.device
    grid = grid_of(volume.volume.shape, border=int(settings.border == "closed"))
    nodes = find_inside(volume, settings, grid)
    tables = make_tables(volume.volume.affine, device, serves_special=serves_special)
    field = field_of(volume, settings, nodes)
    target = volume.volume.affine if affine is None else affine
    depths = slice_depths(None if even_slices else volume.volume, grid, device)
    ranks = rank_edges(nodes, grid, tables.case_triangles, device)
    return EdgeStages(
        settings=settings,
        grid=grid,
        field=field,
        tables=tables,
        ranks=ranks,
        special=list_special(ranks, grid, device),
        fans=find_second_fans(ranks, grid, device),
        affine=grid_affine(target, grid),
        depths=depths,
        true_depths=slice_depths(volume.volume, grid, device) if even_slices else depths,
        is_reversed=faces_reversed(settings, target),
        no_data_nodes=nodes.no_data_count,
        device=device,
    )
