# What the rest of `mesh_io/` uses of this format.

from .reader import read_gmsh as read_gmsh
from .writer import encode_gmsh as encode_gmsh
