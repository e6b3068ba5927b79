# What other folders use of this one; `__init__.py` says what it is for.

from .component_list import (
    Component as Component,
    list_components as list_components,
    mask_of_largest as mask_of_largest,
)
from .curvature import (
    Curvature as Curvature,
    list_curvature as list_curvature,
    measure_curvature as measure_curvature,
)
from .deviation import Deviation as Deviation, measure_deviation as measure_deviation
from .distance import (
    MeshDistance as MeshDistance,
    OneWayDistance as OneWayDistance,
    measure_distance as measure_distance,
)
from .elements import (
    Elements as Elements,
    measure_elements as measure_elements,
)
from .intersections import (
    count_intersections as count_intersections,
    find_intersections as find_intersections,
)
from .kernels import (
    distance_kernels as distance_kernels,
    finding_kernels as finding_kernels,
    kernel_modules as kernel_modules,
    list_kernels as list_kernels,
    quality_kernels as quality_kernels,
    thickness_kernels as thickness_kernels,
)
from .lists import (
    list_deviation as list_deviation,
    list_elements as list_elements,
    list_shapes as list_shapes,
)
from .location import (
    frame_of_volume as frame_of_volume,
    locate_mesh as locate_mesh,
    locate_points as locate_points,
)
from .nearest import NearestFaces as NearestFaces
from .plain_values import plain as plain
from .proximity import Proximity as Proximity, prove_proximity as prove_proximity
from .quality import (
    Quality as Quality,
    choose_diagonals as choose_diagonals,
    measure_quality as measure_quality,
)
from .rounding import (
    cause_and_remedy as cause_and_remedy,
    file_rounding as file_rounding,
    rounding_warning as rounding_warning,
    rounding_warnings as rounding_warnings,
)
from .rounding_kernels import measure_rounding as measure_rounding
from .thickness import (
    Thickness as Thickness,
    list_thickness as list_thickness,
    measure_thickness as measure_thickness,
)
from .topology import (
    Topology as Topology,
    measure_topology as measure_topology,
)
from .vertex_fans import inspect_vertices as inspect_vertices
