# What other programs may rely on; `__init__.py` says what is where.

from .app import ConvertResult as ConvertResult, convert as convert, measure_file as measure_file
from .contouring import Surface as Surface, extract_surface as extract_surface
from .errors import DmcError as DmcError
from .field import upload_volume as upload_volume
from .mesh_io import MeshFile as MeshFile, read_mesh as read_mesh, write_mesh as write_mesh
from .runtime import select_device as select_device
from .settings import (
    ConvertSettings as ConvertSettings,
    MeasureSettings as MeasureSettings,
    MeshSettings as MeshSettings,
    OutputSettings as OutputSettings,
    ReadSettings as ReadSettings,
    SurfaceSettings as SurfaceSettings,
)
from .volume import Volume as Volume
from .volume_io import read_volume as read_volume
