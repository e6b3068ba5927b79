"""Check the arrays of a mesh that a program hands over, before a kernel reads them.

Types and lengths cost nothing to check, and are checked whenever a mesh is made. The vertices that faces name
are checked when the faces are connected, or measured without; `MeshFile` checks those that go to a file.
"""

from collections.abc import Mapping
from typing import Any

import warp as wp

from dmc_cli.errors import CallError
from dmc_cli.mesh_io import count_triangles
from dmc_cli.runtime import Device

REMEDY = "make the mesh of NumPy arrays with mesh_of_file(MeshFile(points=..., faces=...), device)"


def check_device(device: Any) -> None:
    """Raise CallError unless it is a device of ours."""
    if not isinstance(device, Device):
        raise CallError(f"{device!r} was found as the device; expected what select_device returns")


def check_array(name: str, array: Any, dtype: Any, count: int | None, device: Device) -> None:
    """Raise CallError unless it is a Warp array of one axis, contiguous, on the device.

    Args:
        name: What it is, in the plural, for the message.
        array: The array.
        dtype: The type of its items; None for any.
        count: How many it must have; None for any number.
        device: Where it must be.
    """
    if not isinstance(array, wp.array):
        raise CallError(
            f"the {name} are of type {type(array).__name__}; expected a Warp array of"
            f" {_name_of(dtype)}; {REMEDY}"
        )
    is_typed = dtype is None or array.dtype is dtype
    if array.ndim != 1 or not is_typed or not array.is_contiguous:
        kind = "contiguous" if array.is_contiguous else "not contiguous"
        raise CallError(
            f"the {name} are {_name_of(array.dtype)} of shape {array.shape}, {kind}; expected"
            f" {_name_of(dtype)} of one axis, contiguous; {REMEDY}"
        )
    if count is not None and array.shape[0] != count:
        raise CallError(
            f"there are {array.shape[0]} {name}; expected {count}; pass arrays that belong to one mesh"
        )
    if array.device.alias != device.name:
        raise CallError(
            f"the {name} are on {array.device.alias}; expected them on {device.name}, where the mesh is;"
            " pass that device to wp.array"
        )


def check_values(kind: str, values: Mapping[str, Any], count: int, device: Device) -> None:
    """Raise CallError unless each of the values by name is an array of `count` items."""
    for name, array in values.items():
        check_array(f"{kind} values {name!r}", array, None, count, device)


def check_corners(faces: Any, vertex_count: int, triangle_count: int) -> None:
    """Raise CallError unless corners are vertices that are there, and so many faces are triangles.

    Args:
        faces: int32 vec4 (F,); a triangle has -1 as its fourth corner.
        vertex_count: Vertices.
        triangle_count: Faces with three corners, as the mesh tells.
    """
    check_triangle_count(triangle_count, count_triangles(faces.numpy(), vertex_count))


def check_triangle_count(told: int, found: int) -> None:
    """Raise CallError unless as many faces are triangles as the mesh tells."""
    if told != found:
        raise CallError(
            f"triangle_count is {told}; expected {found}, the faces with -1 as their fourth corner;"
            " pass that number, or leave the counting to mesh_of_file"
        )


def _name_of(dtype: Any) -> str:
    """Return how a message calls a type of items."""
    return "any scalar or vector type" if dtype is None else str(getattr(dtype, "__name__", dtype))
