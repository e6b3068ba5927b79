# What other folders use of this one; `__init__.py` says what it is for.

from .brick_ranges import (
    BRICK as BRICK,
    BrickRanges as BrickRanges,
    NodeSteps as NodeSteps,
    bricks_begin as bricks_begin,
    bricks_end as bricks_end,
    compare_bricks as compare_bricks,
    make_brick_ranges as make_brick_ranges,
    widen_ranges as widen_ranges,
)
from .cell_lanes import (
    CornerLanes as CornerLanes,
    gather_corners as gather_corners,
    world_lanes as world_lanes,
)
from .cell_lists import store_cells as store_cells
from .central_differences import difference as difference, mixed as mixed, slopes_in_lanes as slopes_in_lanes
from .corner_slopes import (
    corner_differences as corner_differences,
    gradient_from_corners as gradient_from_corners,
)
from .crossings import (
    ALL_EDGES as ALL_EDGES,
    EdgeSet as EdgeSet,
    Polygon as Polygon,
    crossed_edges as crossed_edges,
    crossing_point as crossing_point,
    edge_set as edge_set,
    edges_among as edges_among,
    edges_at_0 as edges_at_0,
    edges_at_1 as edges_at_1,
    find_crossings as find_crossings,
    high_end as high_end,
    low_end as low_end,
    mean_crossing as mean_crossing,
    measure_polygon as measure_polygon,
    member_along as member_along,
    sum4 as sum4,
)
from .field import (
    FARTHEST as FARTHEST,
    DeviceVolume as DeviceVolume,
    Field as Field,
    VolumeIndex as VolumeIndex,
    cell_values as cell_values,
    make_field as make_field,
    needs_care as needs_care,
    nodata_value as nodata_value,
    node_of_volume as node_of_volume,
    node_value as node_value,
    padding_range as padding_range,
    stored_isovalue as stored_isovalue,
    stored_value as stored_value,
    upload_volume as upload_volume,
)
from .grid import (
    CORNERS as CORNERS,
    EDGES as EDGES,
    Grid as Grid,
    GridShape as GridShape,
    cell_node as cell_node,
    grid_affine as grid_affine,
    grid_of as grid_of,
    index_position as index_position,
    is_mirrored as is_mirrored,
    kernel_matrix as kernel_matrix,
    node_cell as node_cell,
    node_position as node_position,
    row_place as row_place,
    world_coordinate as world_coordinate,
    world_position as world_position,
)
from .kernels import slice_kernels as slice_kernels
from .planes import (
    BITS_A_CHUNK as BITS_A_CHUNK,
    BLOCKS_A_CHUNK as BLOCKS_A_CHUNK,
    Plane as Plane,
    before_line as before_line,
    block_count as block_count,
    make_plane as make_plane,
    position_of as position_of,
    step_along as step_along,
)
from .prefetch import (
    prefetch_around_cuts as prefetch_around_cuts,
    prefetch_neighbors as prefetch_neighbors,
    prefetch_onward as prefetch_onward,
)
from .projection import (
    GridPoint as GridPoint,
    locate_point as locate_point,
    point_at as point_at,
    project_point as project_point,
)
from .sample_reader import (
    IntLanes as IntLanes,
    PairLanes as PairLanes,
    RowLanes as RowLanes,
    bits_at_least as bits_at_least,
    compare_row as compare_row,
    finite_bits as finite_bits,
    pairs_at as pairs_at,
    rows_at as rows_at,
)
from .simd_cells import (
    FloatLanes as FloatLanes,
    find_block_cells as find_block_cells,
    load_points as load_points,
    store_points as store_points,
)
from .slices import (
    depth_position as depth_position,
    map_vertices as map_vertices,
    node_distance as node_distance,
    output_position as output_position,
    slice_depths as slice_depths,
    slice_distance as slice_distance,
)
from .trilinear import (
    NOWHERE as NOWHERE,
    CornerValues as CornerValues,
    CornerValues64 as CornerValues64,
    below_zero as below_zero,
    fits_single as fits_single,
    is_in_cell as is_in_cell,
    newton_step as newton_step,
    single_precision as single_precision,
    solve_along as solve_along,
    trilinear_gradient as trilinear_gradient,
    trilinear_slope_u as trilinear_slope_u,
    trilinear_slope_v as trilinear_slope_v,
    trilinear_slope_w as trilinear_slope_w,
    trilinear_value as trilinear_value,
)
