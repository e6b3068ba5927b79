# What other folders use of this one; `__init__.py` says what it is for.

from .halfedge_dump import (
    HalfedgeDump as HalfedgeDump,
    check_dump_name as check_dump_name,
    write_halfedges as write_halfedges,
)
from .halfedge_numbers import next_halfedges as next_halfedges, previous_halfedges as previous_halfedges
from .mesh_file import (
    LABELS as LABELS,
    NO_CORNER as NO_CORNER,
    MeshFile as MeshFile,
    count_triangles as count_triangles,
    grouped as grouped,
)
from .read import read_mesh as read_mesh
from .selection import flip_faces as flip_faces, keep_faces as keep_faces
from .write import (
    check_encoding as check_encoding,
    check_space as check_space,
    check_unit as check_unit,
    check_values as check_values,
    choose_format as choose_format,
    companion_path as companion_path,
    write_mesh as write_mesh,
)
