"""Hold a mesh, whoever made it: where its vertices are, its faces, and how these join."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import warp as wp

from dmc_cli.errors import CallError, SettingsError
from dmc_cli.mesh.array_checks import check_array, check_corners, check_device, check_values
from dmc_cli.runtime import Device, view

if TYPE_CHECKING:  # its walks are only read by runs that need halfedges
    from dmc_cli.mesh.halfedges import Halfedges

OWN_PREFIX = "dmc "
"""How the names of values begin that stages keep for each other. They are two words each, which no name of a
file's value is; `file_of_mesh` leaves them out."""

DEFECT, COLOR, COLOR24 = OWN_PREFIX + "defect", OWN_PREFIX + "color", OWN_PREFIX + "color24"
"""Values of faces that stages know: uint8, not 0 if a quad has a defect (`defects.py`); colours 0 to 4, of
which neighbours have two; the grid's 24 colours."""


@dataclass(frozen=True)
class Mesh:
    """A mesh of triangles and quads, its mesh faces, on a device. A stage takes one and returns another.

    Whoever has one changes none of its arrays; `simplify` alone takes them over, and says so.

    Attributes:
        positions: float32 vec3 (V,), in the output space.
        faces: int32 vec4 (F,), vertex numbers, anticlockwise seen from where the normal points; a triangle
            has -1 as its fourth corner.
        device: Where the arrays are.
        triangle_count: Faces with three corners.
        halfedges: How the faces join; None as long as nobody has asked (`connect`).
        vertex_values: Arrays of one item a vertex, by name. Stages carry them along: a merged vertex keeps
            the values of the lower of the two, a new one has those of a neighbour. Items are scalars or
            vectors. Names that begin with `OWN_PREFIX` are the stages' own.
        face_values: The same of mesh faces.

    Raises:
        CallError: An array is not of its type and length, contiguous and on the device. What is in the faces
            is looked at when they are connected.
    """

    positions: Any
    faces: Any
    device: Device
    triangle_count: int = 0
    halfedges: "Halfedges | None" = None
    vertex_values: Mapping[str, Any] = field(default_factory=dict)
    face_values: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse arrays that kernels could not read."""
        check_device(self.device)
        check_array("positions", self.positions, wp.vec3, None, self.device)
        check_array("faces", self.faces, wp.vec4i, None, self.device)
        if self.halfedges is not None:
            for name, count in (
                ("twin", 4 * self.face_count),
                ("vertex_halfedge", self.vertex_count),
                ("valence", self.vertex_count),
            ):
                check_array(f"items of {name}", getattr(self.halfedges, name), wp.int32, count, self.device)
        check_values("vertex", self.vertex_values, self.vertex_count, self.device)
        check_values("face", self.face_values, self.face_count, self.device)

    @property
    def vertex_count(self) -> int:
        """Count the vertices."""
        return int(self.positions.shape[0])

    @property
    def face_count(self) -> int:
        """Count the faces."""
        return int(self.faces.shape[0])

    def require_sound(self) -> "Mesh":
        """Return the mesh; raise CallError if it is not connected and its faces name no vertices of it."""
        if self.halfedges is None:
            check_corners(self.faces, self.vertex_count, self.triangle_count)
        return self

    @property
    def corners(self) -> Any:
        """Return the faces as one row of corners, int32 (4F,), the same memory."""
        return flat_corners(self.faces)

    def require_halfedges(self) -> "Halfedges":
        """Return the halfedges; raise CallError if no stage before has connected the mesh."""
        if self.halfedges is None:
            raise CallError(
                "the mesh has no halfedges; expected a connected one; call connect(mesh) first, or"
                " connect_faces(surface)"
            )
        return self.halfedges

    def with_face_values(self, values: Mapping[str, Any]) -> "Mesh":
        """Return the mesh with further values of its faces by name; None takes one away."""
        kept = {**self.face_values, **values}
        return replace(self, face_values={name: v for name, v in kept.items() if v is not None})


def require_mesh(mesh: Mesh) -> Mesh:
    """Return the mesh; raise CallError if it is none, or if its faces name vertices that it does not have."""
    refuse_other(mesh)
    return mesh.require_sound()


def refuse_other(mesh: Mesh) -> None:
    """Raise CallError if it is no mesh."""
    if not isinstance(mesh, Mesh):
        raise CallError(
            f"a {type(mesh).__name__} was found; expected a Mesh; take the mesh of a Surface, and call"
            " mesh_of_file for one of a file first"
        )


def require_quads(mesh: Mesh, stage: str) -> Mesh:
    """Return the mesh if all its faces are quads.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
        SettingsError: There are triangles.
    """
    if require_mesh(mesh).triangle_count:
        raise SettingsError(
            f"{stage} takes meshes of quads; {mesh.triangle_count} of {mesh.face_count} faces are triangles;"
            " leave it out, or make the mesh by a method that gives quads"
        )
    return mesh


def flat_corners(faces: Any) -> Any:
    """Return vec4i (F,) as int32 (4F,): the same memory, kept alive by the view."""
    return view(faces, wp.int32, 4 * faces.shape[0])


def rows_of_four(corners: Any) -> Any:
    """Return int32 (4F,) as vec4i (F,): the same memory, kept alive by the view."""
    return view(corners, wp.vec4i, corners.shape[0] // 4)
