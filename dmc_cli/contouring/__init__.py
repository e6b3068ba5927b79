"""Contouring: from a volume to a surface mesh. A method is a folder, and a line of the registry.

registry              the methods that there are
surface               what a method returns
dual_marching_cubes/  quads only, one vertex a polygon (Grosso & Zint 2021)
extraction            a volume and its settings to a surface, by whichever method
vertex_colors         colours of vertices by the parity of their cells
normals               vertex normals by central differences, whatever the method
"""

from types import ModuleType

from dmc_cli.contouring.extraction import color_faces, connect_faces, extract_surface
from dmc_cli.contouring.normals import compute_normals
from dmc_cli.contouring.registry import METHODS
from dmc_cli.contouring.surface import Surface, SurfaceCounts
from dmc_cli.field.field import DeviceVolume, upload_volume
from dmc_cli.settings import Method, PlacementRule

__all__ = [
    "METHODS",
    "DeviceVolume",
    "Surface",
    "SurfaceCounts",
    "color_faces",
    "compute_normals",
    "connect_faces",
    "extract_surface",
    "kernel_modules",
    "mesh_kernel_modules",
    "upload_volume",
]


def kernel_modules(
    *, normals_too: bool = True, method: Method = "dmc", placement: PlacementRule = "exact"
) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, for loading them ahead of time.

    The one that takes longest to compile comes first, so that it is not the last to be ready.
    """
    from dmc_cli.contouring import normals

    modules = METHODS[method].kernels(placement)
    return [normals, *modules] if normals_too else modules


def mesh_kernel_modules(*, method: Method = "dmc", colors: bool = False) -> list[ModuleType]:
    """Return the modules whose kernels connecting the faces needs, and colouring them if that is wanted."""
    modules = METHODS[method].mesh_kernels(colors=colors)
    if colors:
        from dmc_cli.contouring import vertex_colors

        modules.append(vertex_colors)
    return modules
