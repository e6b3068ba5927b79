# What the rest of `mesh_io/` uses of this format.

from .reader import read_abaqus as read_abaqus
from .writer import encode_abaqus as encode_abaqus
