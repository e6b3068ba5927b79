"""Read GLB: the triangles of the scene's nodes, put together to quads where the file says how.

glTF is in metres with y up; a mesh is in millimetres with z up, or in the unit that a file of ours tells.
Attributes whose names begin with `_` are values of vertices.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import orjson

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.glb.ngons import put_together
from dmc_cli.mesh_io.glb.writer import BINARY_CHUNK, JSON_CHUNK, MAGIC, NGONS, VERSION
from dmc_cli.mesh_io.joined import Piece, joined, turned_normals
from dmc_cli.mesh_io.mesh_file import MeshFile, on_screen
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.settings import OutputUnit
from dmc_cli.volume import UNIT_LENGTHS, Color

TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
VECTORS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES = 4
"""glTF's number of a primitive of triangles."""

DEEPEST = 100
"""Nodes below nodes, at most: a file whose nodes lie in each other in a circle has no end."""

NEAREST = 1e-6
"""How near a transformation must be to one that changes nothing to be taken for it: a quarter turn there and
back, or a scale of a thousandth, is rounded."""

NO_MATERIAL = -1

Z_UP_AGAIN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def read_glb(path: Path) -> MeshFile:
    """Read the meshes of a GLB file's scene as one; nodes, and materials within one, are groups.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: Its meshes are compressed, or kept in other files.
    """
    file = _File(path)
    try:
        return _mesh(path, file)
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        raise MeshFileError(f"{path}: the JSON is not that of glTF 2.0: {error!r}; it is damaged") from error


def _mesh(path: Path, file: "_File") -> MeshFile:
    extras = file.json.get("asset", {}).get("extras") or {}
    unit: OutputUnit = extras["UNIT"] if extras.get("UNIT") in get_args(OutputUnit) else "mm"
    told: set[str] = set()
    pieces = []
    for place, (matrix, node) in enumerate(file.placed()):
        turned = _turned(matrix, 1000 / UNIT_LENGTHS[unit])
        mesh = file.json["meshes"][node["mesh"]]
        title = str(node.get("name") or mesh.get("name") or "")
        primitives = [each for each in mesh["primitives"] if each.get("mode", TRIANGLES) == TRIANGLES]
        told |= {"points, lines and strips"} if len(primitives) < len(mesh["primitives"]) else set()
        materials = [primitive.get("material", NO_MATERIAL) for primitive in primitives]
        for primitive, material in zip(primitives, materials, strict=True):
            name, color = file.material(material, told)
            whole = f"{title}_{name}" if len(set(materials)) > 1 else title
            piece = _piece(file, primitive, turned, told)
            pieces.append(replace(piece, name=whole.strip("_"), part=(place, material), color=color))
    return make_mesh(
        str(path),
        comments=f"SPACE={extras.get('SPACE', 'none')}\nUNIT={unit}\n".encode(),
        **joined(str(path), pieces, told),
        warnings=unread(path, sorted(told)),
    )


def _piece(file: "_File", primitive: dict[str, Any], turned: Float64Array, told: set[str]) -> Piece:
    """Return a primitive where it lies, with its normals and the values whose names begin with `_`."""
    attributes = primitive["attributes"]
    places = file.array(attributes["POSITION"])
    if (places.dtype.kind != "f") or places.ndim != 2 or places.shape[1] != 3:
        raise UnsupportedFormatError(
            f"{file.path}: positions of whole numbers were found; expected float32; write it uncompressed"
        )
    normals, values = None, {}
    for name, number in attributes.items():
        array = file.array(number) if name == "NORMAL" or name[:1] == "_" else None
        if array is not None and len(array) == len(places) and name != "NORMAL":
            values[name[1:]] = array
        elif array is not None and array.dtype.kind == "f" and array.shape == places.shape:
            normals = turned_normals(array, turned[:, :3])
        if name != "POSITION" and (normals is None if name == "NORMAL" else name[1:] not in values):
            told.add(name)
    counts, corners = file.faces(primitive, len(places))
    return Piece(places @ turned[:, :3].T + turned[:, 3], counts, corners, normals, values)


def _turned(matrix: Float64Array, scale: float) -> Float64Array:
    """Return the map into the scene, z up, in a unit of which so many make a metre; shape (3, 4)."""
    turned: Float64Array = scale * Z_UP_AGAIN @ matrix[:3]
    whole = np.eye(3, 4)
    return whole if np.abs(turned - whole).max() < NEAREST else turned


class _File:
    """The JSON and the numbers of a file.

    Attributes:
        json: What it says.
        path: For messages.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        data = path.read_bytes()
        if data[:4] != MAGIC or int.from_bytes(data[4:8], "little") != VERSION:
            raise MeshFileError(
                f"{path}: glTF and version {VERSION} were expected at the start; this is no GLB file"
            )
        chunks = dict(_chunks(data))
        try:
            self.json: dict[str, Any] = orjson.loads(chunks.get(JSON_CHUNK, b""))
        except orjson.JSONDecodeError as error:
            raise MeshFileError(f"{path}: the JSON is damaged: {error}") from error
        self._numbers = chunks.get(BINARY_CHUNK, b"")
        if not isinstance(self.json, dict):
            raise MeshFileError(f"{path}: the JSON is no object; expected that of glTF 2.0")

    def placed(self) -> Iterator[tuple[Float64Array, dict[str, Any]]]:
        """Yield each node of the scene that has a mesh, with its transformation, (4, 4), before it."""
        scenes = self.json.get("scenes") or []
        nodes = self.json.get("nodes") or []
        roots = scenes[self.json.get("scene", 0)].get("nodes", []) if scenes else range(len(nodes))
        waiting = [(node, np.eye(4), 0) for node in reversed(roots)]
        while waiting:
            number, above, depth = waiting.pop()
            node = nodes[number]
            matrix = above @ _matrix(node)
            if "mesh" in node:
                yield matrix, node
            if depth > DEEPEST:
                raise MeshFileError(
                    f"{self.path}: nodes lie more than {DEEPEST} deep in each other; it is damaged"
                )
            waiting += [(child, matrix, depth + 1) for child in reversed(node.get("children", []))]

    def material(self, number: int, told: set[str]) -> tuple[str, Color | None]:
        """Return name and colour of a material; textures are told."""
        if number == NO_MATERIAL:
            return "", None
        material = self.json["materials"][number]
        shine = material.get("pbrMetallicRoughness", {})
        told |= {"textures"} if any("Texture" in key for key in (*material, *shine)) else set()
        light = shine.get("baseColorFactor", [] if "baseColorTexture" in shine else [1, 1, 1])
        return str(material.get("name") or f"material_{number}"), on_screen(light)

    def array(self, number: int) -> AnyArray:
        """Return an array of the file."""
        accessor = self.json["accessors"][number]
        if "bufferView" not in accessor or "sparse" in accessor:
            raise UnsupportedFormatError(
                f"{self.path}: an array that is sparse or compressed was found; expected plain numbers;"
                " write it uncompressed"
            )
        view = self.json["bufferViews"][accessor["bufferView"]]
        if "uri" in self.json["buffers"][view["buffer"]] or view["buffer"]:
            raise UnsupportedFormatError(
                f"{self.path}: numbers in another file were found; expected all in one GLB; write it so"
            )
        dtype = np.dtype("<" + TYPES[accessor["componentType"]])
        width, count = VECTORS[accessor["type"]], accessor["count"]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        step = view.get("byteStride", width * dtype.itemsize)
        end = start + (count - 1) * step + width * dtype.itemsize
        if not (count >= 0 and start >= 0 and step > 0 and (not count or end <= len(self._numbers))):
            raise MeshFileError(f"{self.path}: an array ends beyond the file; it is cut off")
        rows = np.ndarray((count, width), dtype, self._numbers, start, (step, dtype.itemsize))
        return rows.astype(dtype.newbyteorder("="))

    def faces(self, primitive: dict[str, Any], vertex_count: int) -> tuple[AnyArray, AnyArray]:
        """Return the number of corners of each face of a primitive, and the corners in a row."""
        if "indices" in primitive:
            corners = self.array(primitive["indices"]).ravel().astype(np.int64)
        else:
            corners = np.arange(vertex_count)
        if len(corners) % 3 or (corners >= vertex_count).any():
            raise MeshFileError(
                f"{self.path}: {len(corners)} corners of triangles of {vertex_count} vertices do not fit;"
                " it is damaged"
            )
        if NGONS in primitive.get("extensions", {}):
            return put_together(corners.reshape(-1, 3))
        return np.full(len(corners) // 3, 3), corners


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the kind and the bytes of each chunk."""
    position = 12
    while position + 8 <= len(data):
        length = int.from_bytes(data[position : position + 4], "little")
        yield data[position + 4 : position + 8], data[position + 8 : position + 8 + length]
        position += 8 + length


def _matrix(node: dict[str, Any]) -> Float64Array:
    """Return a node's own transformation, (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), float)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), float)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix
