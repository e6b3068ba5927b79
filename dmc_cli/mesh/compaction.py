"""Renumber a mesh without its removed vertices and faces: by filling the gaps, or in order.

Filling: what does not move keeps its number; the gaps, in ascending order, take what stays of the numbers
beyond the new end, in ascending order. So the work and the memory beside the mesh grow with what was removed,
not with the mesh. In order: all that stays moves to new arrays, where there are no gaps. Both are the same
moves, of vertices, of faces and of all values that belong to them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.bits import VECTOR_FLAGS, WORDS_A_CHUNK, list_mask, low_bits, mask_flagged, part
from dmc_cli.mesh.mesh import Mesh
from dmc_cli.mesh.placement import Placement
from dmc_cli.mesh.working import MeshArrays, WorkingMesh, with_arrays
from dmc_cli.runtime import FLAGS_A_CHUNK, ITEMS_A_CHUNK, Device, native, size_of, view

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


@dataclass(frozen=True)
class Moves:
    """Which items go where: `gaps` take `movers` in order.

    Attributes:
        end: Where the first of what may move is: the number of items that stay where gaps are filled, 0 where
            all move.
        count: Items that stay.
        gaps: Places, int32 (M,).
        movers: Items, int32 (M,).
        moved_to: For each item from `end` on the place that it goes to, int32.
    """

    end: int
    count: int
    gaps: Any
    movers: Any
    moved_to: Any


def fill_gaps(mesh: WorkingMesh) -> tuple[Mesh, Placement]:
    """Return the mesh without gaps; its arrays are views of those that the working mesh has."""
    device, arrays = mesh.device, mesh.arrays
    vertices, faces = _plan_filling(device, arrays.vertex_gone), _plan_filling(device, arrays.face_gone)
    _move(mesh, mesh, vertices, faces)
    if vertices.gaps.shape[0]:
        inputs = [arrays, vertices.end, 4 * faces.end, vertices.moved_to]
        device.launch(rename_vertices_kernel, -(-faces.end // 16), inputs, [])
    inputs = [arrays, faces.gaps, faces.movers, faces.end, faces.moved_to]
    device.launch(rename_faces_kernel, faces.gaps.shape[0], inputs, [], ITEMS_A_CHUNK)
    return _shortened(mesh, vertices.count, faces.count).as_mesh()


def pack(mesh: WorkingMesh) -> tuple[WorkingMesh, Any]:
    """Return a copy without gaps, all in the order that it was in, and the new number of each face, int32."""
    device = mesh.device
    vertices, faces = (
        _plan_packing(device, gone) for gone in (mesh.arrays.vertex_gone, mesh.arrays.face_gone)
    )
    packed = _empty_like(mesh, vertices.count, faces.count)
    _move(mesh, packed, vertices, faces)
    inputs = [packed.arrays, vertices.moved_to, faces.moved_to]
    device.launch(rename_packed_faces_kernel, faces.count, inputs, [])
    device.launch(rename_packed_vertices_kernel, vertices.count, [packed.arrays, faces.moved_to], [])
    return packed, faces.moved_to


def _move(source: WorkingMesh, target: WorkingMesh, vertices: Moves, faces: Moves) -> None:
    """Move vertices, faces and their values, numbers as they were."""
    device, arrays = source.device, [source.arrays, target.arrays]
    for kernel, moves in ((move_vertices_kernel, vertices), (move_faces_kernel, faces)):
        inputs = [*arrays, moves.gaps, moves.movers]
        device.launch(kernel, moves.gaps.shape[0], inputs, [], ITEMS_A_CHUNK)
    for moves, old, new in (
        (vertices, source.vertex_values, target.vertex_values),
        (faces, source.face_values, target.face_values),
    ):
        for name, values in old.items():
            copy_values(device, moves.gaps, moves.movers, values, new[name])


def copy_values(device: Device, places: Any, items: Any, source: Any, target: Any) -> None:
    """Copy the values of items to places, int32 (n,) both; source and target may be one array."""
    inputs = [places, items, _as_bytes(source)]
    device.launch(copy_values_kernel, places.shape[0], inputs, [_as_bytes(target)], FLAGS_A_CHUNK)


def _as_bytes(values: Any) -> Any:
    """Return values as uint8 (n, bytes of an item): the same memory."""
    return view(values, wp.uint8, (values.shape[0], size_of(values.dtype)))


def _shortened(mesh: WorkingMesh, vertices: int, faces: int) -> WorkingMesh:
    """Return a mesh of its first vertices and faces; no array is copied."""
    device, old = mesh.device, mesh.arrays
    arrays = MeshArrays()
    arrays.corners, arrays.twin = (part(device, a, 0, 4 * faces) for a in (old.corners, old.twin))
    for name in ("vertex_halfedge", "valence", "position", "cell", "local"):
        setattr(arrays, name, part(device, getattr(old, name), 0, vertices))
    return replace(
        mesh,
        arrays=arrays,
        vertex_values=_parts(device, mesh.vertex_values, vertices),
        face_values=_parts(device, mesh.face_values, faces),
    )


def _parts(device: Device, values: Mapping[str, Any], count: int) -> dict[str, Any]:
    """Return the first items of values by name."""
    return {name: part(device, found, 0, count) for name, found in values.items()}


def _empty_like(mesh: WorkingMesh, vertices: int, faces: int) -> WorkingMesh:
    """Return a mesh with arrays of other lengths, to be written."""
    device = mesh.device
    arrays = MeshArrays()
    arrays.corners, arrays.twin = (device.empty(4 * faces, wp.int32) for _ in range(2))
    arrays.vertex_halfedge, arrays.valence = (device.empty(vertices, wp.int32) for _ in range(2))
    arrays.position, arrays.local = (device.empty(vertices, wp.vec3) for _ in range(2))
    arrays.cell = device.empty(vertices, wp.int64)
    arrays.face_gone, arrays.vertex_gone = (device.zeros(n, wp.uint8) for n in (faces, vertices))
    vertex_values, face_values = (
        {name: device.empty(n, found.dtype) for name, found in values.items()}
        for n, values in ((vertices, mesh.vertex_values), (faces, mesh.face_values))
    )
    return with_arrays(mesh, arrays, vertex_values, face_values)


def _plan_filling(device: Device, gone: Any) -> Moves:
    """Return where items go that fill gaps, given a flag (uint8, not 0) for each that has gone."""
    count = gone.shape[0]
    mask, gone_count = mask_flagged(device, gone)
    end = count - gone_count
    device.launch(find_moves_kernel, mask.shape[0], [end, count], [mask], 16 * WORDS_A_CHUNK)
    listed = list_mask(device, mask)
    half = listed.shape[0] // 2
    moved_to = device.empty(count - end, wp.int32)
    gaps, movers = part(device, listed, 0, half), part(device, listed, half, 2 * half)
    device.launch(tell_moves_kernel, half, [gaps, movers, end], [moved_to], FLAGS_A_CHUNK)
    return Moves(end, end, gaps, movers, moved_to)


def _plan_packing(device: Device, gone: Any) -> Moves:
    """Return where all items go that stay, in order."""
    count = gone.shape[0]
    mask, gone_count = mask_flagged(device, gone)
    device.launch(find_staying_kernel, mask.shape[0], [count], [mask], 16 * WORDS_A_CHUNK)
    movers = list_mask(device, mask)
    gaps = wp.array(np.arange(count - gone_count, dtype=np.int32), dtype=wp.int32, device=device.name)
    moved_to = device.empty(count, wp.int32)
    device.launch(tell_moves_kernel, gaps.shape[0], [gaps, movers, 0], [moved_to], FLAGS_A_CHUNK)
    return Moves(0, count - gone_count, gaps, movers, moved_to)


@wp.kernel
def find_moves_kernel(
    # In:
    first: wp.int32,
    end: wp.int32,
    count: wp.int32,
    # In/out:
    mask_inout: wp.array(dtype=wp.uint32),
) -> None:
    """Turn a mask of all gaps into one of those before the new end and of what stays beyond it.

    There are as many of each. One thread per 32 items.
    """
    w = first + wp.tid()
    ahead = low_bits(end - 32 * w)
    mask_inout[w] = (mask_inout[w] ^ ~ahead) & low_bits(count - 32 * w)


@wp.kernel
def find_staying_kernel(
    # In:
    first: wp.int32,
    count: wp.int32,
    # In/out:
    mask_inout: wp.array(dtype=wp.uint32),
) -> None:
    """Turn a mask of what has gone into one of what stays. One thread per 32 items."""
    w = first + wp.tid()
    mask_inout[w] = ~mask_inout[w] & low_bits(count - 32 * w)


@wp.kernel
def tell_moves_kernel(
    # In:
    first: wp.int32,
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
    end: wp.int32,
    # Out:
    moved_to_out: wp.array(dtype=wp.int32),
) -> None:
    """Write the gap that each mover goes to as its new number. One thread per mover."""
    n = first + wp.tid()
    moved_to_out[movers[n] - end] = gaps[n]


@wp.kernel
def move_vertices_kernel(
    # In:
    first: wp.int32,
    source: MeshArrays,
    target: MeshArrays,  # changed
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
) -> None:
    """Move the vertices. One thread per mover."""
    n = first + wp.tid()
    gap = gaps[n]
    v = movers[n]
    target.position[gap] = source.position[v]
    target.cell[gap] = source.cell[v]
    target.local[gap] = source.local[v]
    target.valence[gap] = source.valence[v]
    target.vertex_halfedge[gap] = source.vertex_halfedge[v]


@wp.kernel
def move_faces_kernel(
    # In:
    first: wp.int32,
    source: MeshArrays,
    target: MeshArrays,  # changed
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
) -> None:
    """Move the faces. One thread per mover."""
    n = first + wp.tid()
    gap = gaps[n]
    f = movers[n]
    for c in range(4):
        target.corners[4 * gap + c] = source.corners[4 * f + c]
        target.twin[4 * gap + c] = source.twin[4 * f + c]


@wp.kernel
def copy_values_kernel(
    # In:
    first: wp.int32,
    places: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    source: wp.array2d(dtype=wp.uint8),
    # Out:
    target_out: wp.array2d(dtype=wp.uint8),
) -> None:
    """Copy values, byte by byte. One thread per item."""
    n = first + wp.tid()
    for byte in range(source.shape[1]):
        target_out[places[n], byte] = source[items[n], byte]


@wp.func_native(native(__file__, "highest_corner"))
def highest_corner(corners: wp.array(dtype=wp.int32), block: wp.int32) -> wp.int32:
    """Return the highest vertex of the faces 16 `block` to 16 `block` + 15."""
    ...


@wp.kernel
def rename_vertices_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    end: wp.int32,
    corner_count: wp.int32,
    moved_to: wp.array(dtype=wp.int32),
) -> None:
    """Give the faces their moved vertices' new numbers. One thread per 16 faces: most have none."""
    block = first + wp.tid()
    if 64 * block + 64 <= corner_count:
        if highest_corner(mesh.corners, block) < end:
            return
    for n in range(64 * block, wp.min(64 * block + 64, corner_count)):
        v = mesh.corners[n]
        if v >= end:
            mesh.corners[n] = moved_to[v - end]


@wp.kernel
def rename_faces_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
    end: wp.int32,
    moved_to: wp.array(dtype=wp.int32),
) -> None:
    """Tell twins and vertices the moved faces' new numbers. One thread per mover.

    Two moved faces that are neighbours write the same to each other.
    """
    n = first + wp.tid()
    for c in range(4):
        h = 4 * gaps[n] + c
        t = mesh.twin[h]
        if t >= 4 * end:
            t = 4 * moved_to[(t >> 2) - end] + (t & 3)
            mesh.twin[h] = t
        if t >= 0:
            mesh.twin[t] = h
        v = mesh.corners[h]
        if v >= 0:
            if mesh.vertex_halfedge[v] == 4 * movers[n] + c:
                mesh.vertex_halfedge[v] = h


@wp.func
def new_halfedge(new_faces: wp.array(dtype=wp.int32), h: wp.int32) -> wp.int32:
    """Return a halfedge's number once its face has its own; an absent one stays so."""
    return wp.where(h < 0, -1, 4 * new_faces[wp.max(h, 0) >> 2] + (h & 3))


@wp.kernel
def rename_packed_faces_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    new_vertices: wp.array(dtype=wp.int32),
    new_faces: wp.array(dtype=wp.int32),
) -> None:
    """Give corners and twins their new numbers. One thread per face."""
    f = first + wp.tid()
    for c in range(4):
        v = mesh.corners[4 * f + c]
        if v >= 0:
            mesh.corners[4 * f + c] = new_vertices[v]
        mesh.twin[4 * f + c] = new_halfedge(new_faces, mesh.twin[4 * f + c])


@wp.kernel
def rename_packed_vertices_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    new_faces: wp.array(dtype=wp.int32),
) -> None:
    """Give the vertices' halfedges their new numbers. One thread per vertex."""
    v = first + wp.tid()
    mesh.vertex_halfedge[v] = new_halfedge(new_faces, mesh.vertex_halfedge[v])
