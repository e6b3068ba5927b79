"""Register the formats of meshes: a file or a folder of `mesh_io/` each, and an entry here.

Settings, help texts, messages and the README's table are made from this list. Writers and readers are
imported when they are called.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any, Literal


@dataclass(frozen=True, kw_only=True)
class MeshFormat:
    """A format, and where its functions are, as `module:function`.

    Attributes:
        title: Its name.
        suffix: The one that means it.
        other_suffixes: More that do.
        encode: From a `MeshFile` to chunks of bytes.
        read: From a path to a `MeshFile`.
        encoding: Text, binary, or either: binary unless `--ascii` asks for text.
        is_ras_mm: Whether coordinates are RAS in millimetres by definition.
        holds_quads: Whether faces of four corners stay whole; else they are split into triangles.
        holds_normals: Whether there is a place for normals.
        holds_vertex_values: Whether there is one for values of vertices.
        holds_face_values: Whether there is one for values of faces.
        holds_groups: Whether there is one for names of parts.
        holds_colors: Whether there is one for colours.
        takes_element: Whether there is a choice of the kind of element that a face is.
        companion_suffix: That of a file that stands beside the mesh and tells its colours, or none.
        encode_companion: From a `MeshFile` to the chunks of that file, none where there is nothing to tell;
            its name is given to `encode` as `companion`.
    """

    title: str
    suffix: str
    encode: str
    read: str
    encoding: Literal["text", "binary", "either"] = "text"
    is_ras_mm: bool = False
    holds_quads: bool = True
    holds_normals: bool = True
    holds_vertex_values: bool = False
    holds_face_values: bool = False
    holds_groups: bool = False
    holds_colors: bool = False
    other_suffixes: tuple[str, ...] = ()
    takes_element: bool = False
    companion_suffix: str = ""
    encode_companion: str = ""

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Return all suffixes that mean it."""
        return (self.suffix, *self.other_suffixes)


FORMATS: dict[str, MeshFormat] = {
    "ply": MeshFormat(
        title="PLY",
        holds_colors=True,
        suffix=".ply",
        encode="ply:encode_ply",
        read="ply:read_ply",
        encoding="either",
        holds_vertex_values=True,
        holds_face_values=True,
    ),
    "obj": MeshFormat(
        title="OBJ",
        suffix=".obj",
        encode="obj:encode_obj",
        read="obj:read_obj",
        companion_suffix=".mtl",
        encode_companion="obj:encode_materials",
        holds_groups=True,
        holds_colors=True,
    ),
    "off": MeshFormat(
        title="OFF", suffix=".off", encode="off:encode_off", read="off:read_off", holds_normals=False
    ),
    "stl": MeshFormat(
        title="STL",
        suffix=".stl",
        encode="stl:encode_stl",
        read="stl:read_stl",
        encoding="either",
        holds_quads=False,
        holds_normals=False,
    ),
    "vtp": MeshFormat(
        title="VTP",
        holds_colors=True,
        suffix=".vtp",
        encode="vtk:encode_vtp",
        read="vtk:read_vtp",
        encoding="either",
        holds_vertex_values=True,
        holds_face_values=True,
    ),
    "vtu": MeshFormat(
        title="VTU",
        holds_colors=True,
        suffix=".vtu",
        encode="vtk:encode_vtu",
        read="vtk:read_vtu",
        encoding="either",
        holds_vertex_values=True,
        holds_face_values=True,
    ),
    "vtk": MeshFormat(
        title="legacy VTK",
        holds_colors=True,
        suffix=".vtk",
        encode="vtk:encode_legacy",
        read="vtk:read_legacy",
        encoding="either",
        holds_vertex_values=True,
        holds_face_values=True,
    ),
    "glb": MeshFormat(
        title="GLB",
        holds_colors=True,
        suffix=".glb",
        encode="glb:encode_glb",
        read="glb:read_glb",
        encoding="binary",
        holds_vertex_values=True,
        holds_groups=True,
    ),
    "3mf": MeshFormat(
        title="3MF",
        holds_colors=True,
        suffix=".3mf",
        encode="three_mf:encode_3mf",
        read="three_mf:read_3mf",
        encoding="binary",
        holds_quads=False,
        holds_normals=False,
        holds_groups=True,
    ),
    "msh": MeshFormat(
        title="Gmsh",
        suffix=".msh",
        encode="gmsh:encode_gmsh",
        read="gmsh:read_gmsh",
        encoding="either",
        holds_normals=False,
        holds_vertex_values=True,
        holds_face_values=True,
        holds_groups=True,
    ),
    "inp": MeshFormat(
        title="Abaqus",
        suffix=".inp",
        encode="abaqus:encode_abaqus",
        read="abaqus:read_abaqus",
        holds_normals=False,
        holds_groups=True,
        takes_element=True,
    ),
    "nas": MeshFormat(
        title="Nastran",
        suffix=".nas",
        other_suffixes=(".bdf",),
        encode="nastran:encode_nastran",
        read="nastran:read_nastran",
        holds_normals=False,
        holds_groups=True,
    ),
    "k": MeshFormat(
        title="LS-DYNA",
        suffix=".k",
        other_suffixes=(".key",),
        encode="ls_dyna:encode_ls_dyna",
        read="ls_dyna:read_ls_dyna",
        holds_normals=False,
        holds_groups=True,
    ),
    "medit": MeshFormat(
        title="Medit",
        suffix=".mesh",
        encode="medit:encode_medit",
        read="medit:read_medit",
        holds_normals=False,
        holds_groups=True,
    ),
    "xdmf": MeshFormat(
        title="XDMF",
        suffix=".xdmf",
        other_suffixes=(".xmf",),
        encode="xdmf:encode_xdmf",
        read="xdmf:read_xdmf",
        holds_normals=False,
        holds_vertex_values=True,
        holds_face_values=True,
    ),
    "gii": MeshFormat(
        title="GIfTI",
        suffix=".gii",
        encode="gifti:encode_gifti",
        read="gifti:read_gifti",
        encoding="either",
        is_ras_mm=True,
        holds_quads=False,
        holds_normals=False,
    ),
    "freesurfer": MeshFormat(
        title="FreeSurfer",
        suffix=".pial",
        other_suffixes=(".white", ".inflated", ".surf"),
        encode="freesurfer:encode_freesurfer",
        read="freesurfer:read_freesurfer",
        encoding="binary",
        is_ras_mm=True,
        holds_quads=False,
        holds_normals=False,
    ),
    "usda": MeshFormat(
        title="USD",
        holds_colors=True,
        suffix=".usda",
        encode="usd:encode_usd",
        read="usd:read_usd",
        holds_vertex_values=True,
        holds_face_values=True,
        holds_groups=True,
    ),
}
"""The formats by their names, as `--output-format` takes them."""


def function(place: str) -> Callable[..., Any]:
    """Import and return the function at a place of `MeshFormat`."""
    found: Callable[..., Any] = resolve_name(f"dmc_cli.mesh_io.{place}")
    return found


def format_by_suffix(path: str) -> str | None:
    """Return the name of the format that a path's suffix means, None where it means none."""
    from pathlib import PurePath

    suffix = PurePath(path).suffix.lower()
    return next((name for name, known in FORMATS.items() if suffix in known.suffixes), None)


def known_suffixes() -> list[str]:
    """Return the suffixes that mean a format, in the order of the list."""
    return [suffix for known in FORMATS.values() for suffix in known.suffixes]
