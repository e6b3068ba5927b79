"""Turn the mesh of a file into one on a device, and back: the only way between the two.

Values of vertices and faces go along, whatever they are called: a number an item becomes an array of scalars,
several an array of vectors (the label pair: of two int32). What stages keep for each other stays behind.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import CallError
from dmc_cli.mesh.array_checks import check_triangle_count
from dmc_cli.mesh.mesh import OWN_PREFIX, Mesh, refuse_other
from dmc_cli.mesh_io import MeshFile
from dmc_cli.runtime import Device
from dmc_cli.settings import OutputUnit
from dmc_cli.volume import Space


def mesh_of_file(file: MeshFile, device: Device) -> Mesh:
    """Return the mesh of a file on a device, coordinates rounded to float32, not connected.

    Normals and space are left to the file: a mesh has neither. No array is shared.

    Raises:
        CallError: It is no `MeshFile`.
    """
    if not isinstance(file, MeshFile):
        raise CallError(
            f"a {type(file).__name__} was found; expected a MeshFile, as read_mesh returns it or as"
            " MeshFile(points=..., faces=...) makes it of arrays"
        )
    return Mesh(
        wp.array(file.points.astype(np.float32), dtype=wp.vec3f, device=device.name),
        wp.array(file.faces, dtype=wp.vec4i, device=device.name),
        device,
        triangle_count=file.triangle_count,
        vertex_values=_on_device(file.vertex_values, device),
        face_values=_on_device(file.face_values, device),
    )


def file_of_mesh(
    mesh: Mesh,
    normals: Any | None = None,
    space: Space = "none",
    unit: OutputUnit = "mm",
    *,
    vertex_values: Mapping[str, AnyArray] | None = None,
    face_values: Mapping[str, AnyArray] | None = None,
) -> MeshFile:
    """Return a mesh as files have it; on CPU the arrays are the same memory.

    Args:
        mesh: The mesh.
        normals: Unit normals of its vertices, float32 vec3 (V,) or (V, 3), or None. Those of a file that was
            read hold as long as no vertex has moved.
        space: The axes that its coordinates are in.
        unit: Their unit.
        vertex_values: Values of its vertices beside those that it has, as `MeshFile` takes them.
        face_values: Values of its faces likewise.

    Raises:
        CallError: It is no mesh, its faces name vertices that it does not have, a value has a type or a name
            that files cannot hold, or a coordinate is not finite.
    """
    refuse_other(mesh)
    file = MeshFile(
        points=mesh.positions.numpy(),
        faces=mesh.faces.numpy(),
        normals=None if normals is None else normals.numpy() if isinstance(normals, wp.array) else normals,
        space=space,
        unit=unit,
        vertex_values=_on_host(mesh.vertex_values) | dict(vertex_values or {}),
        face_values=_on_host(mesh.face_values) | dict(face_values or {}),
    )
    check_triangle_count(mesh.triangle_count, file.triangle_count)
    return file


def _on_device(values: Mapping[str, AnyArray], device: Device) -> dict[str, Any]:
    """Return values as arrays of scalars or, where an item has several numbers, of vectors."""
    found = {}
    for name, array in values.items():
        dtype: Any = wp.dtype_from_numpy(array.dtype)
        if array.ndim == 2:
            dtype = wp.types.vector(length=array.shape[1], dtype=dtype)
        found[name] = wp.array(np.ascontiguousarray(array), dtype=dtype, device=device.name)
    return found


def _on_host(values: Mapping[str, Any]) -> dict[str, AnyArray]:
    """Return values as NumPy arrays, without those that stages keep for each other."""
    return {name: array.numpy() for name, array in values.items() if not name.startswith(OWN_PREFIX)}
