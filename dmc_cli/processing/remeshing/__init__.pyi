# What other folders use of this one; `__init__.py` says what it is for.

from .bench import (
    portions as portions,
    take_mesh as take_mesh,
    take_points as take_points,
    take_regions as take_regions,
)
from .chains import (
    ASCENT as ASCENT,
    link as link,
    next_rotation as next_rotation,
    rotation_cost as rotation_cost,
    scrambled as scrambled,
)
from .checks import (
    PatchMeasures as PatchMeasures,
    folded_sides as folded_sides,
    gather_patch as gather_patch,
    grow_patch as grow_patch,
    irregularity_change as irregularity_change,
    is_core_sound as is_core_sound,
    measure_patch as measure_patch,
    quads_removed as quads_removed,
)
from .kernels import region_kernels as region_kernels, remeshing_kernels as remeshing_kernels
from .moves import (
    exchange_places as exchange_places,
    goal_of as goal_of,
    keep_places as keep_places,
    note_place as note_place,
    put_at as put_at,
    restore_places as restore_places,
)
from .operations import collapse_quad as collapse_quad, doublet_of as doublet_of, rotate_edge as rotate_edge
from .patches import add_ring_to_patch as add_ring_to_patch, add_to_patch as add_to_patch
from .regions import (
    FROZEN as FROZEN,
    SIDE as SIDE,
    Regions as Regions,
    find_starts_kernel as find_starts_kernel,
    frozen_vertices as frozen_vertices,
    make_regions as make_regions,
)
from .rounds import Remeshed as Remeshed, Rounds as Rounds, remesh as remesh
from .tracked_points import (
    list_points_of_patch as list_points_of_patch,
    take_new_nearest as take_new_nearest,
)
from .work import (
    CORNER as CORNER,
    FACE_GONE as FACE_GONE,
    JOURNALLED as JOURNALLED,
    KEPT as KEPT,
    PATCHED as PATCHED,
    REMOVED as REMOVED,
    TOUCHED as TOUCHED,
    TRACKED as TRACKED,
    Work as Work,
    begin as begin,
    clear_failure as clear_failure,
    fail as fail,
    has_failed as has_failed,
    is_own as is_own,
    outgoing as outgoing,
    redo as redo,
    touch as touch,
    undo as undo,
)
