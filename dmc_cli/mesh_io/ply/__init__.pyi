# What the rest of `mesh_io/` uses of this format.

from .reader import read_ply as read_ply
from .writer import encode_ply as encode_ply
