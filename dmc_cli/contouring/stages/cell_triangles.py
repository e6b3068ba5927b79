"""Connect the triangles of the cells whose polygons the tables of cases give.

A cell's case tells its polygons, and the ranks of its edges their vertices; the twelve of a cell are found at
once. Triangles lie in grid order of their cells. Of the triangulations of a polygon that are allowed the
standard one is taken, or the best: that with the largest least quality of a triangle, the radius of the inner
circle by that of the outer one, as the surface lies in the world. For that the polygons of some rows are
listed by their number of edges, and sixteen of a list are judged at once.
"""

from functools import cache
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Float64Array, FloatArray
from dmc_cli.bits import VECTOR_FLAGS, Words
from dmc_cli.contouring.stages.edge_ranks import EdgeBits, EdgeRanks
from dmc_cli.contouring.stages.triangulations import case_tables
from dmc_cli.field import CORNERS, EDGES, Grid, GridShape, before_line
from dmc_cli.runtime import Device, native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


@wp.struct
class Tables:
    """What kernels look up of the cases: `CaseTables` on the device, and the polygons that are served.

    Attributes:
        polygon_count: Polygons of each case, uint8; 0 where other kernels make its triangles.
        case_triangles: Triangles of each case, likewise.
        frame: Where the points of a cell's edges lie, float32 (4, 3, 16): each edge's origin, and what a step
            between slices adds to it; the same of its direction.
    """

    polygon_count: wp.array(dtype=wp.uint8)
    case_triangles: wp.array(dtype=wp.uint8)
    first_polygon: wp.array(dtype=wp.int32)
    edges: wp.array(dtype=wp.uint32)
    sizes: wp.array(dtype=wp.uint8)
    standard: wp.array(dtype=wp.uint8)
    allowed: wp.array(dtype=wp.uint64)
    corners: wp.array(dtype=wp.uint8)
    members: wp.array(dtype=wp.uint8)
    frame: wp.array(dtype=wp.float32)


def make_tables(
    affine: Float64Array, device: Device, *, serves_special: bool, from_middles: bool = False
) -> Any:
    """Return the kernels' `Tables`.

    Args:
        affine: Shape (4, 4): node index, slices even, to the world in which triangles are judged.
        device: Where to work.
        serves_special: Serve cases that may have several polygons or a tunnel, too.
        from_middles: Places of vertices count from the middles of edges, not from their lower nodes.
    """
    tables = Tables()
    for name, array in _device_tables(device.name, serves_special).items():
        setattr(tables, name, array)
    tables.frame = wp.array(_edge_frame(affine[:3, :3], 0.5 if from_middles else 0.0), device=device.name)
    return tables


@cache
def _device_tables(device: str, serves_special: bool) -> dict[str, Any]:
    """Return the arrays of `Tables` that are the same for all volumes, on a device."""
    found = case_tables()
    is_served = serves_special | ~found.is_special
    arrays = {
        "polygon_count": (np.diff(found.first_polygon) * is_served).astype(np.uint8),
        "case_triangles": (found.triangles * is_served).astype(np.uint8),
        **{name: getattr(found, name) for name in ("first_polygon", "edges", "sizes", "standard")},
        **{name: getattr(found, name) for name in ("allowed", "corners", "members")},
    }
    return {name: wp.array(array.ravel(), device=device) for name, array in arrays.items()}


_STARTS = np.array([CORNERS[low] for low, _ in EDGES] + [(0, 0, 0)] * 4, np.float64)

_ALONG = np.array([CORNERS[high] for _, high in EDGES] + [(0, 0, 0)] * 4, np.float64) - _STARTS
"""Where each edge of a cell starts, and its direction, in a row of sixteen."""


def _edge_frame(linear: Float64Array, origin: float) -> FloatArray:
    """Return `Tables.frame`, in units of the longest step to a neighbour; `origin` is how far along edges."""
    scaled = linear / np.abs(linear).max()
    parts = [
        scaled[:, axes] @ vectors[:, axes].T
        for vectors in (_STARTS + origin * _ALONG, _ALONG)
        for axes in (slice(0, 2), slice(2, 3))
    ]
    return np.stack(parts).astype(np.float32).ravel()


def connect_triangles(
    ranks: EdgeRanks,
    crossing: Any,
    tables: Any,
    depths: Any,
    grid: GridShape,
    device: Device,
    *,
    is_best: bool,
    is_reversed: bool,
    others: int = 0,
) -> Any:
    """Begin to connect the triangles, int32 vec4 (T,); they are there for the next launch.

    Args:
        ranks: The numbers of vertices and triangles.
        crossing: How far along its edge each vertex lies.
        tables: The kernels' `Tables`.
        depths: Depths of uneven slices, else empty.
        grid: The grid over the volume.
        device: Where to work.
        is_best: Triangulate polygons as well as can be, else as the standard table does.
        is_reversed: Make normals point towards the inside nodes instead of away from them.
        others: Further triangles to leave room for.
    """
    faces = device.empty(ranks.triangle_count + others, wp.vec4i)
    inputs = [grid.struct(), ranks.bits, ranks.triangle_starts, depths, crossing, tables]
    inputs += [int(is_best), int(is_reversed), grid.rows, device.span]
    outputs = [faces, device.empty(0, wp.uint8)]
    device.begin(connect_rows_kernel, -(-grid.rows // device.span), inputs, outputs, 1)
    return faces


@wp.func_native(native(__file__, "connect_rows", WIDTH=1))
def connect_rows(
    inside: wp.array(dtype=Words),
    exists: wp.array(dtype=Words),
    is_marked: wp.int32,
    nodes: wp.vec3i,
    words: wp.int32,
    ahead: wp.int32,
    start: wp.int32,
    end: wp.int32,
    edge_starts: wp.array(dtype=wp.int64),
    along_x: wp.array(dtype=wp.int32),
    along_y: wp.array(dtype=wp.int32),
    triangle_starts: wp.array(dtype=wp.int64),
    depths: wp.array(dtype=wp.float64),
    place: wp.array(dtype=wp.float32),
    frame: wp.array(dtype=wp.float32),
    polygon_count: wp.array(dtype=wp.uint8),
    first_polygon: wp.array(dtype=wp.int32),
    edges: wp.array(dtype=wp.uint32),
    sizes: wp.array(dtype=wp.uint8),
    standard: wp.array(dtype=wp.uint8),
    allowed: wp.array(dtype=wp.uint64),
    corners: wp.array(dtype=wp.uint8),
    members: wp.array(dtype=wp.uint8),
    is_best: wp.int32,
    is_reversed: wp.int32,
    least: wp.float32,
    faces_out: wp.array(dtype=wp.vec4i),
    poor_out: wp.array(dtype=wp.uint8),
) -> None:
    """Connect the triangles of rows `start` to `end` - 1; `ahead` words lie before the lines."""
    ...


@wp.kernel
def connect_rows_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    triangle_starts: wp.array(dtype=wp.int64),
    depths: wp.array(dtype=wp.float64),
    crossing: wp.array(dtype=wp.float32),
    tables: Tables,
    is_best: wp.int32,
    is_reversed: wp.int32,
    rows: wp.int32,
    span: wp.int32,
    # Out:
    faces_out: wp.array(dtype=wp.vec4i),
    poor_out: wp.array(dtype=wp.uint8),
) -> None:
    """Connect the triangles of some rows. One thread per `span` rows of nodes; `poor_out` is not used."""
    start = (first + wp.tid()) * span
    end = wp.min(start + span, rows)
    if triangle_starts[start] == triangle_starts[end]:
        return
    connect_rows(
        bits.inside,
        bits.exists,
        bits.is_marked,
        wp.vec3i(grid.nx, grid.ny, grid.nz),
        grid.words,
        before_line(grid),
        start,
        end,
        bits.starts,
        bits.along_x,
        bits.along_y,
        triangle_starts,
        depths,
        crossing,
        tables.frame,
        tables.polygon_count,
        tables.first_polygon,
        tables.edges,
        tables.sizes,
        tables.standard,
        tables.allowed,
        tables.corners,
        tables.members,
        is_best,
        is_reversed,
        0.0,
        faces_out,
        poor_out,
    )
