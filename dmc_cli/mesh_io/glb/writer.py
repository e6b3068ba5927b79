"""Write GLB: a JSON that says where everything lies, then one block of numbers.

glTF is in metres with y up, scans are in millimetres with z up: numbers are written as they are, and the
nodes have the scale and a quarter turn. Values of vertices are attributes whose names begin with `_`. Each
group is a node. Triangles say which of them make a quad (`ngons.py`), unless a face has a corner twice.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import orjson

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import SettingsError, WriteError
from dmc_cli.mesh_io.glb.ngons import apart, can_be_told
from dmc_cli.mesh_io.mesh_file import MeshFile, linear, parts_of
from dmc_cli.mesh_io.text import chunks_of
from dmc_cli.mesh_io.triangles import fans, triangle_count, triangles_of
from dmc_cli.volume import UNIT_LENGTHS

MAGIC, VERSION = b"glTF", 2
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
FLOAT, UINT32 = 5126, 5125
ATTRIBUTES, INDICES = 34962, 34963
"""glTF's numbers of types and of what a view is for."""

Z_UP = (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)
"""The quarter turn, a quaternion, that lays z on glTF's y."""

NGONS = "FB_ngon_encoding"
VECTORS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
LARGEST = 2**32 - 1
"""Bytes of a file, at most."""


@dataclass
class _Scene:
    """The JSON's lists as they grow, and the bytes that the numbers take so far."""

    nodes: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    views: list[dict[str, Any]] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    size: int = 0

    def add(self, kind: int, vector: str, count: int, size: int, target: int, **more: Any) -> int:
        """Add an array with a view of its own; return its number."""
        self.accessors.append(
            {"bufferView": len(self.views), "componentType": kind, "count": count, "type": vector, **more}
        )
        self.views.append({"buffer": 0, "byteOffset": self.size, "byteLength": size, "target": target})
        self.size += size
        return len(self.accessors) - 1


def encode_glb(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a GLB file, with normals, values of vertices and groups where the mesh has them.

    Raises:
        SettingsError: A value is no number, which glTF cannot hold.
        WriteError: There are more than 4 GiB.
    """
    scene = _Scene()
    for name, part in parts_of(mesh, "mesh"):
        _add_part(scene, name, part)
    text = orjson.dumps(_json(scene, mesh))
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 * bool(scene.size) + scene.size
    if length > LARGEST:
        raise WriteError(
            f"a GLB file of {length} bytes cannot be written: it holds 4 GiB; choose a format without a"
            " limit, such as PLY or VTP, or a smaller mesh"
        )
    yield MAGIC + VERSION.to_bytes(4, "little") + length.to_bytes(4, "little")
    yield len(text).to_bytes(4, "little") + JSON_CHUNK + text
    if not scene.size:
        return
    yield scene.size.to_bytes(4, "little") + BINARY_CHUNK
    for _, part in parts_of(mesh, "mesh"):
        yield from _numbers(part)


def _json(scene: _Scene, mesh: MeshFile) -> dict[str, Any]:
    """Return what the file says of its numbers."""
    found = {
        "asset": {"version": "2.0", "generator": "dmc"} | ({"extras": mesh.tags} if mesh.tags else {}),
        "scene": 0,
        "scenes": [{"nodes": list(range(len(scene.nodes)))}],
        "nodes": scene.nodes,
    }
    if scene.meshes:
        if any("extensions" in mesh["primitives"][0] for mesh in scene.meshes):
            found["extensionsUsed"] = [NGONS]
        if scene.materials:
            found["materials"] = scene.materials
        found |= {
            "meshes": scene.meshes,
            "accessors": scene.accessors,
            "bufferViews": scene.views,
            "buffers": [{"byteLength": scene.size}],
        }
    return found


def _add_part(scene: _Scene, name: str, part: MeshFile) -> None:
    """Add a node for a part, and a mesh unless it is empty, which glTF does not allow."""
    length = UNIT_LENGTHS[part.unit] / 1000
    node: dict[str, Any] = {"name": name, "rotation": Z_UP, "scale": [length] * 3}
    scene.nodes.append(node)
    if not len(part.faces):
        return
    node["mesh"] = len(scene.meshes)
    count = len(part.points)
    ends = [limit(part.points, axis=0).astype(np.float32).tolist() for limit in (np.min, np.max)]
    place = {"min": ends[0], "max": ends[1]}
    attributes = {"POSITION": scene.add(FLOAT, "VEC3", count, 12 * count, ATTRIBUTES, **place)}
    if part.normals is not None:
        attributes["NORMAL"] = scene.add(FLOAT, "VEC3", count, 12 * count, ATTRIBUTES)
    for value, column in _columns(part):
        width = 1 if column.ndim == 1 else column.shape[1]
        attributes[f"_{value}"] = scene.add(FLOAT, VECTORS[width], count, 4 * width * count, ATTRIBUTES)
    corners = 3 * triangle_count(part)
    primitive: dict[str, Any] = {
        "attributes": attributes,
        "indices": scene.add(UINT32, "SCALAR", corners, 4 * corners, INDICES),
    }
    if all(map(can_be_told, chunks_of(part.faces))):
        primitive["extensions"] = {NGONS: {}}
    if part.color is not None:
        primitive["material"] = len(scene.materials)
        shine = {"baseColorFactor": [*linear(part.color), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}
        scene.materials.append({"name": name, "pbrMetallicRoughness": shine})
    scene.meshes.append({"name": name, "primitives": [primitive]})


def _columns(part: MeshFile) -> Iterator[tuple[str, AnyArray]]:
    """Yield the values of vertices by name; one of more than four numbers a vertex is several."""
    for name, array in part.vertex_values.items():
        if not np.isfinite(array.astype(np.float32)).all():
            raise SettingsError(
                f"the value {name} is no finite number at some vertices, which GLB cannot hold; expected"
                " finite ones; leave it out, or choose another format, such as VTP"
            )
        if array.ndim == 1 or array.shape[1] in VECTORS:
            yield name, array
        else:
            yield from ((f"{name}_{c}", array[:, c]) for c in range(array.shape[1]))


def _numbers(part: MeshFile) -> Iterator[bytes]:
    """Yield the numbers of a part in the order of its arrays."""
    if not len(part.faces):
        return
    normals = [] if part.normals is None else [part.normals]
    for array in (part.points, *normals, *(column for _, column in _columns(part))):
        for rows in chunks_of(array, np.float32):
            yield rows.astype("<f4", copy=False).tobytes()
    last = -1
    for faces in chunks_of(part.faces):
        ordered = apart(fans(part, faces), last)
        last = int(ordered[-1, 0])
        yield triangles_of(ordered).astype("<u4").tobytes()
