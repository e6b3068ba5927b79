"""The isosurface: from stored values to vertices and quads, in the order of the imports below.

grid        numbering of nodes, cells, edges and faces; one bit a node
field       the scalar field F whose zero set is the surface
inside      inside bits: the one pass over the values
cells       active cells, ordinary and special, and their numbers
polygons    MC polygons of the special cells, traced
placement   one vertex a polygon on the trilinear surface
blocks      vertices of ordinary cells on CPU, sixteen at a time
vertices    vertices of all cells
quads       one quad a crossed edge
surface     the stages in order
normals     vertex normals by central differences
"""

from types import ModuleType

from dmc_cli.surface import blocks, cells, inside, normals, polygons, quads, vertices
from dmc_cli.surface.field import DeviceVolume, upload_volume
from dmc_cli.surface.normals import compute_normals
from dmc_cli.surface.surface import Surface, SurfaceCounts, extract_surface

__all__ = [
    "DeviceVolume",
    "Surface",
    "SurfaceCounts",
    "compute_normals",
    "extract_surface",
    "kernel_modules",
    "upload_volume",
]


def kernel_modules(*, normals_too: bool = True) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, for loading them ahead of time."""
    modules = [inside, cells, polygons, blocks, vertices, quads]
    return [*modules, normals] if normals_too else modules
