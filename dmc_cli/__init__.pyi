# What other programs may rely on; `__init__.py` says what is where.

from .app import (
    ConvertResult as ConvertResult,
    LabelResult as LabelResult,
    ReworkResult as ReworkResult,
    convert as convert,
    convert_labels as convert_labels,
    measure_file as measure_file,
    rework_file as rework_file,
)
from .contouring import (
    Surface as Surface,
    color_faces as color_faces,
    compute_normals as compute_normals,
    connect_faces as connect_faces,
    extract_surface as extract_surface,
)
from .errors import CallError as CallError, DmcError as DmcError
from .field import upload_volume as upload_volume
from .measures import (
    find_intersections as find_intersections,
    list_thickness as list_thickness,
    locate_mesh as locate_mesh,
    measure_curvature as measure_curvature,
    measure_distance as measure_distance,
    measure_elements as measure_elements,
    measure_quality as measure_quality,
    measure_thickness as measure_thickness,
    measure_topology as measure_topology,
)
from .mesh import (
    Mesh as Mesh,
    Placement as Placement,
    connect as connect,
    file_of_mesh as file_of_mesh,
    mesh_of_file as mesh_of_file,
)
from .mesh_io import MeshFile as MeshFile, read_mesh as read_mesh, write_mesh as write_mesh
from .parts import band_volume as band_volume, crop_volume as crop_volume, select_part as select_part
from .processing import decimate as decimate, relax as relax, remesh as remesh, simplify as simplify
from .runtime import select_device as select_device
from .settings import (
    ConvertSettings as ConvertSettings,
    LabelSettings as LabelSettings,
    MeasureSettings as MeasureSettings,
    MeshSettings as MeshSettings,
    OutputSettings as OutputSettings,
    PartSettings as PartSettings,
    ReadSettings as ReadSettings,
    ReworkSettings as ReworkSettings,
    SurfaceSettings as SurfaceSettings,
)
from .volume import Suggestions as Suggestions, Volume as Volume
from .volume_io import read_volume as read_volume
