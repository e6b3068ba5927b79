# What other folders use of this one; `__init__.py` says what it is for.

from .box_tree import (
    CHILDREN as CHILDREN,
    BoxTree as BoxTree,
    Levels as Levels,
    Masks as Masks,
    boxes_meeting as boxes_meeting,
    boxes_near as boxes_near,
    boxes_on_ray as boxes_on_ray,
    build_tree as build_tree,
    child_count as child_count,
    curve_frame as curve_frame,
    curve_number as curve_number,
)
from .check import check_mesh as check_mesh
from .compaction import copy_values as copy_values, fill_gaps as fill_gaps, pack as pack
from .connectivity import connect as connect, connect_by as connect_by
from .defects import with_defects as with_defects
from .halfedges import (
    Halfedges as Halfedges,
    next_halfedge as next_halfedge,
    next_in_quad as next_in_quad,
    next_outgoing as next_outgoing,
    next_outgoing_of_any as next_outgoing_of_any,
    opposite_in_quad as opposite_in_quad,
    previous_halfedge as previous_halfedge,
    previous_in_quad as previous_in_quad,
    quad_corner as quad_corner,
    ring_size as ring_size,
)
from .kernels import (
    changing_kernels as changing_kernels,
    connecting_kernels as connecting_kernels,
    tree_kernels as tree_kernels,
)
from .mesh import (
    COLOR as COLOR,
    COLOR24 as COLOR24,
    DEFECT as DEFECT,
    OWN_PREFIX as OWN_PREFIX,
    Mesh as Mesh,
    flat_corners as flat_corners,
    require_mesh as require_mesh,
    require_quads as require_quads,
)
from .mesh_files import file_of_mesh as file_of_mesh, mesh_of_file as mesh_of_file
from .near_frame import (
    COARSE as COARSE,
    HALF_STEP as HALF_STEP,
    in_frame_of as in_frame_of,
    in_near_frame as in_near_frame,
)
from .normals import area_vectors as area_vectors, vertex_normals as vertex_normals
from .placement import (
    Placement as Placement,
    SurfaceFrame as SurfaceFrame,
    refuse_lost as refuse_lost,
    require_placement as require_placement,
)
from .valences import (
    REGULAR as REGULAR,
    REGULAR_OF_TRIANGLES as REGULAR_OF_TRIANGLES,
    irregular_percent as irregular_percent,
    regular_valence as regular_valence,
)
from .working import (
    MeshArrays as MeshArrays,
    WorkingMesh as WorkingMesh,
    is_skipped as is_skipped,
    mesh_arrays as mesh_arrays,
    require_places as require_places,
    set_twins as set_twins,
    with_room as with_room,
    working_mesh as working_mesh,
)
