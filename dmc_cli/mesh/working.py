"""Hold a mesh while faces are removed and added: numbers stay, what is not there is flagged.

Stages change the arrays in place and keep twins, valences and the vertices' halfedges true;
`compaction.py` renumbers at the end. That is the papers' rebuild after each pass, with the work confined to
where faces went.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import warp as wp

from dmc_cli.errors import CallError
from dmc_cli.mesh.halfedges import Halfedges
from dmc_cli.mesh.mesh import DEFECT, Mesh, rows_of_four
from dmc_cli.mesh.placement import Placement, SurfaceFrame, require_placement
from dmc_cli.mesh_io import NO_CORNER
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False})


@wp.struct
class MeshArrays:
    """The kernels' view of a mesh; corners and twin (4F,), defect and face_gone (F,), the others (V,).

    What a stage has no use for may be empty: `defect`, and the flags of what has gone. Functions take the
    arrays that they need, never the whole: it is copied with every call.
    """

    corners: wp.array(dtype=wp.int32)
    twin: wp.array(dtype=wp.int32)
    defect: wp.array(dtype=wp.uint8)
    face_gone: wp.array(dtype=wp.uint8)
    vertex_halfedge: wp.array(dtype=wp.int32)
    valence: wp.array(dtype=wp.int32)
    vertex_gone: wp.array(dtype=wp.uint8)
    position: wp.array(dtype=wp.vec3)
    cell: wp.array(dtype=wp.int64)
    local: wp.array(dtype=wp.vec3)


@dataclass(frozen=True)
class WorkingMesh:
    """The arrays, and what belongs to them.

    Attributes:
        arrays: The kernels' `MeshArrays`.
        frame: The surface that the vertices lie on.
        vertex_values: As of a `Mesh`.
        face_values: Likewise.
        device: Where the arrays are.
        has_triangles: Whether faces may have three corners.
        seams: Lists of the halfedges that got new twins, int32, -1 for none; each pass adds its own. Those
            where no colours clash may be left out.
    """

    arrays: Any
    frame: SurfaceFrame
    vertex_values: Mapping[str, Any]
    face_values: Mapping[str, Any]
    device: Device
    has_triangles: bool = False
    seams: list[Any] = field(default_factory=list)

    @property
    def face_count(self) -> int:
        """Count the places for faces."""
        return int(self.arrays.face_gone.shape[0])

    @property
    def vertex_count(self) -> int:
        """Count the places for vertices."""
        return int(self.arrays.vertex_gone.shape[0])

    def as_mesh(self) -> tuple[Mesh, Placement]:
        """Return a mesh without gaps as what it is; the arrays are the same."""
        arrays = self.arrays
        halfedges = Halfedges(arrays.twin, arrays.vertex_halfedge, arrays.valence)
        faces = rows_of_four(arrays.corners)
        triangles = int((faces.numpy()[:, 3] == NO_CORNER).sum()) if self.has_triangles else 0
        mesh = Mesh(
            arrays.position,
            faces,
            self.device,
            triangle_count=triangles,
            halfedges=halfedges,
            vertex_values=self.vertex_values,
            face_values=self.face_values,
        )
        return mesh, Placement(arrays.cell, arrays.local, self.frame)


def require_places(mesh: Mesh, placement: Placement) -> None:
    """Raise CallError unless the placement has a place for each vertex of the mesh."""
    if require_placement(placement).cell.shape[0] != mesh.vertex_count:
        raise CallError(
            f"the placement has {placement.cell.shape[0]} places; expected {mesh.vertex_count}, one a vertex"
            " of the mesh; pass the mesh and the placement that one stage returned together"
        )


def mesh_arrays(mesh: Mesh, placement: Placement | None = None) -> Any:
    """Return the kernels' view of a connected mesh; nothing of it is flagged as gone."""
    halfedges = mesh.require_halfedges()
    arrays = MeshArrays()
    arrays.corners, arrays.twin, arrays.valence = mesh.corners, halfedges.twin, halfedges.valence
    arrays.vertex_halfedge, arrays.position = halfedges.vertex_halfedge, mesh.positions
    if placement is not None:
        require_places(mesh, placement)
        arrays.cell, arrays.local = placement.cell, placement.local
    return arrays


def working_mesh(mesh: Mesh, placement: Placement) -> WorkingMesh:
    """Take over the arrays of a connected mesh and its placement: both are of no use afterwards."""
    arrays = mesh_arrays(mesh, placement)
    arrays.face_gone = mesh.device.zeros(mesh.face_count, wp.uint8)
    arrays.vertex_gone = mesh.device.zeros(mesh.vertex_count, wp.uint8)
    working = WorkingMesh(arrays, placement.frame, {}, {}, mesh.device, has_triangles=mesh.triangle_count > 0)
    return with_arrays(working, arrays, mesh.vertex_values, mesh.face_values)


def with_arrays(
    mesh: WorkingMesh, arrays: Any, vertex_values: Mapping[str, Any], face_values: Mapping[str, Any]
) -> WorkingMesh:
    """Return the working mesh with other arrays and values; kernels find the defects among the arrays."""
    if DEFECT in face_values:
        arrays.defect = face_values[DEFECT]
    return replace(mesh, arrays=arrays, vertex_values=vertex_values, face_values=face_values)


def with_room(mesh: WorkingMesh, spare: int) -> WorkingMesh:
    """Return a copy with `spare` more places for vertices and for faces, which are flagged as gone."""
    device, old = mesh.device, mesh.arrays
    arrays = MeshArrays()
    arrays.corners, arrays.twin = (_longer(a, 4 * spare, device) for a in (old.corners, old.twin))
    arrays.vertex_halfedge = _longer(old.vertex_halfedge, spare, device)
    arrays.valence, arrays.position = (_longer(a, spare, device) for a in (old.valence, old.position))
    arrays.cell, arrays.local = (_longer(a, spare, device) for a in (old.cell, old.local))
    arrays.face_gone = _longer(old.face_gone, spare, device, 1)
    arrays.vertex_gone = _longer(old.vertex_gone, spare, device, 1)
    face_values, vertex_values = (
        {name: _longer(values, spare, device) for name, values in found.items()}
        for found in (mesh.face_values, mesh.vertex_values)
    )
    return with_arrays(mesh, arrays, vertex_values, face_values)


def _longer(array: Any, more: int, device: Device, value: int = 0) -> Any:
    """Return a copy of an array with more items at its end."""
    count = array.shape[0]
    longer = device.empty(count + more, array.dtype)
    if count:
        wp.copy(longer, array, count=count)
    if more:
        longer[count:].fill_(value)
    return longer


@wp.func
def is_skipped(twin: wp.array(dtype=wp.int32), defect: wp.array(dtype=wp.uint8), q: wp.int32) -> wp.bool:
    """Return whether a quad or a neighbour has a side without a twin or on a non-manifold edge."""
    if defect[q] != wp.uint8(0):
        return True
    beside = defect[twin[4 * q] >> 2] | defect[twin[4 * q + 1] >> 2]
    beside |= defect[twin[4 * q + 2] >> 2] | defect[twin[4 * q + 3] >> 2]
    return beside != wp.uint8(0)


@wp.func
def set_twins(twin: wp.array(dtype=wp.int32), h: wp.int32, other: wp.int32) -> None:
    """Make two halfedges twins; neither is absent."""
    twin[h] = other
    twin[other] = h
