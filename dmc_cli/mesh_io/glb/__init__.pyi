# What the rest of `mesh_io/` uses of this format.

from .reader import read_glb as read_glb
from .writer import encode_glb as encode_glb
