# What the rest of `mesh_io/` uses of this format.

from .legacy_reader import read_legacy as read_legacy
from .legacy_writer import encode_legacy as encode_legacy
from .xml_reader import read_vtp as read_vtp, read_vtu as read_vtu
from .xml_writer import encode_vtp as encode_vtp, encode_vtu as encode_vtu
