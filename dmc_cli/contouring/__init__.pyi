# What other folders use of this one; `__init__.py` says what it is for.

from .extraction import (
    color_faces as color_faces,
    connect_faces as connect_faces,
    extract_surface as extract_surface,
    list_flips as list_flips,
    list_tunnels as list_tunnels,
)
from .kernels import (
    every_kernel_module as every_kernel_module,
    kernel_modules as kernel_modules,
    mesh_kernel_modules as mesh_kernel_modules,
    normal_kernels as normal_kernels,
)
from .label_surfaces import (
    LabelNet as LabelNet,
    NetSmoother as NetSmoother,
    Shells as Shells,
    extract_net as extract_net,
    extract_shells as extract_shells,
    label_kernels as label_kernels,
)
from .normals import compute_normals as compute_normals
from .stages.classification import find_inside as find_inside
from .surface import Surface as Surface, SurfaceCounts as SurfaceCounts
from .vertex_colors import color_vertices as color_vertices
