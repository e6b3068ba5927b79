"""Write USD as text (.usda), and read it by its own library: meshes of polygons with values, quads whole.

A stage is in millimetres with z up. Each group is a mesh; values are primvars of vertices or faces.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.joined import Piece, joined, turned_normals
from dmc_cli.mesh_io.mesh_file import NO_CORNER, MeshFile, linear, on_screen, parts_of
from dmc_cli.mesh_io.numbered import solver_names
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.mesh_io.text import chunks_of, number_lines
from dmc_cli.settings import OutputUnit
from dmc_cli.volume import UNIT_LENGTHS, Color

TYPES = {
    "i1": "int", "u1": "uchar", "i2": "int", "u2": "int", "i4": "int", "u4": "uint", "f4": "float",
    "f8": "double",
}  # fmt: skip
"""USD's words for types of numbers; of two to four together there are none of uchar and uint."""

VECTORS = {"int", "float", "double"}


def encode_usd(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of a USD stage, normals, values and groups where the mesh has them; it is text."""
    tags = "".join(f'        string {name} = "{value}"\n' for name, value in mesh.tags.items())
    told = f"    customLayerData = {{\n{tags}    }}\n" if tags else ""
    yield (
        f'#usda 1.0\n(\n{told}    defaultPrim = "dmc"\n    doc = "written by dmc"\n'
        f"    metersPerUnit = {UNIT_LENGTHS[mesh.unit] / 1000!r}\n"
        '    upAxis = "Z"\n)\n\ndef Xform "dmc"\n{\n'
    ).encode("ascii")
    names = solver_names(list(mesh.groups) or ["mesh"])
    for name, (_, part) in zip(names, parts_of(mesh, "mesh"), strict=True):
        yield from _mesh(name, part)
    yield b"}\n"


def _mesh(name: str, part: MeshFile) -> Iterator[bytes]:
    """Yield a mesh."""
    yield f'    def Mesh "{name}"\n    {{\n        uniform token subdivisionScheme = "none"\n'.encode("ascii")
    if len(part.points):
        ends = np.stack([part.points.min(axis=0), part.points.max(axis=0)]).astype(np.float32)
        yield from _array("float3[] extent", iter([ends]))
    counts = (np.where(faces[:, 3] == NO_CORNER, 3, 4) for faces in chunks_of(part.faces))
    yield from _array("int[] faceVertexCounts", counts)
    yield from _array(
        "int[] faceVertexIndices", (faces[faces != NO_CORNER] for faces in chunks_of(part.faces))
    )
    yield from _array("point3f[] points", chunks_of(part.points, np.float32))
    if part.normals is not None:
        yield from _array("normal3f[] normals", chunks_of(part.normals), "vertex")
    if part.color is not None:
        color = iter([np.array([linear(part.color)], np.float32)])
        yield from _array("color3f[] primvars:displayColor", color, "constant")
    yield from _values(part.vertex_values, "vertex")
    yield from _values(part.face_values, "uniform")
    yield b"    }\n"


def _values(values: Mapping[str, AnyArray], interpolation: str) -> Iterator[bytes]:
    """Yield values as primvars; what USD has no vector for is several."""
    for name, array in values.items():
        kind, width = TYPES[array.dtype.str[1:]], 1 if array.ndim == 1 else array.shape[1]
        if width == 1 or (width <= 4 and kind in VECTORS):
            word = f"{kind}{width if width > 1 else ''}[] primvars:{solver_names([name])[0]}"
            yield from _array(word, chunks_of(array), interpolation)
        else:
            yield from _values({f"{name}_{c}": array[:, c] for c in range(width)}, interpolation)


def _array(name: str, chunks: Iterator[AnyArray], interpolation: str = "") -> Iterator[bytes]:
    """Yield an attribute: a line a row, several numbers in brackets, commas between."""
    yield f"        {name} = [".encode("ascii")
    before = b""
    for rows in map(np.ascontiguousarray, chunks):
        text = number_lines(rows).rstrip(b"\n")
        if rows.ndim > 1:
            text = b"(" + text.replace(b" ", b", ").replace(b"\n", b"),\n(") + b")"
        else:
            text = text.replace(b"\n", b",\n")
        yield before + text
        before = b",\n"
    yield b"]"
    yield (
        f' (\n            interpolation = "{interpolation}"\n        )\n'.encode("ascii")
        if interpolation
        else b"\n"
    )


def read_usd(path: Path) -> MeshFile:
    """Read the meshes of a USD stage as groups of one, in its unit, or in millimetres if we have none such.

    Raises:
        UnsupportedFormatError: The library is missing.
        MeshFileError: The file is damaged.
    """
    try:
        from pxr import Usd, UsdGeom
    except ImportError as error:
        raise UnsupportedFormatError(
            f"{path}: USD is read by its own library, which is missing; install it with pip install"
            " 'dmc-cli[usd]', or measure another format"
        ) from error
    try:
        stage: Any = Usd.Stage.Open(str(path))
        length = 1000 * UsdGeom.GetStageMetersPerUnit(stage)
    except Exception as error:
        raise MeshFileError(f"{path}: USD's library cannot read it: {_told(error)}") from error
    if not 0 < length < np.inf:
        raise MeshFileError(
            f"{path}: a unit of {length / 1000:g} metres was found; expected a length above 0; it is damaged"
        )
    unit = next((u for u in get_args(OutputUnit) if abs(UNIT_LENGTHS[u] / length - 1) < 1e-9), None)
    factor = 1.0 if unit is not None else length
    turn = np.eye(3) if UsdGeom.GetStageUpAxis(stage) == "Z" else np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    told: set[str] = set()
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    try:
        pieces = [_piece(mesh, turn * factor, told) for mesh in meshes]
    except (TypeError, ValueError) as error:
        raise MeshFileError(
            f"{path}: an attribute of a mesh has no numbers of USD's types ({error}); it is damaged"
        ) from error
    tags = stage.GetRootLayer().customLayerData
    return make_mesh(
        str(path),
        comments=f"SPACE={tags.get('SPACE', 'none')}\nUNIT={unit or 'mm'}\n".encode(),
        **joined(str(path), pieces, told),
        warnings=unread(path, sorted(told)),
    )


def _piece(mesh: Any, turn: AnyArray, told: set[str]) -> Piece:
    """Return a mesh where it lies, with normals and primvars of its vertices, and primvars of its faces."""
    from pxr import Usd, UsdGeom

    matrix = np.array(mesh.ComputeLocalToWorldTransform(Usd.TimeCode.Default()))  # of rows
    linear = matrix[:3, :3] @ turn
    places = np.array(mesh.GetPointsAttr().Get() or np.zeros((0, 3)), float).reshape(-1, 3)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], int)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], int)
    normals = None
    if mesh.GetNormalsAttr().HasValue():
        found = np.array(mesh.GetNormalsAttr().Get(), float)
        if found.shape == places.shape and mesh.GetNormalsInterpolation() in ("vertex", "varying"):
            normals = turned_normals(found, linear.T)
        told |= {"normals"} if normals is None else set()
    values: dict[str, dict[str, AnyArray]] = {"vertex": {}, "uniform": {}}
    sizes = {"vertex": len(places), "uniform": len(counts)}
    color = None
    for primvar in UsdGeom.PrimvarsAPI(mesh).GetPrimvarsWithValues():
        name, kind = str(primvar.GetPrimvarName()), str(primvar.GetInterpolation())
        array = np.array(primvar.ComputeFlattened()) if kind in sizes else np.zeros(0)
        if kind in sizes and array.ndim in (1, 2) and len(array) == sizes[kind]:
            values[kind][name] = array
        elif name == "displayColor" and (color := _one_color(primvar)) is not None:
            continue
        else:
            told.add(name)
    told |= {"subsets of faces"} if UsdGeom.Subset.GetAllGeomSubsets(mesh) else set()
    moved = places @ linear + matrix[3, :3] @ turn
    name = str(mesh.GetPrim().GetName())
    return Piece(moved, counts, corners, normals, values["vertex"], values["uniform"], name, color=color)


def _one_color(primvar: Any) -> Color | None:
    """Return the colour of a mesh that has one of all; None if there are several."""
    lights = np.array(primvar.ComputeFlattened())
    is_one = lights.shape == (1, 3) and lights.dtype.kind == "f"
    return on_screen(lights[0].tolist()) if is_one else None


def _told(error: Exception) -> str:
    """Return the last line of what the library says; it says nothing of bytes that are no text."""
    try:
        lines = str(error).strip().splitlines()
    except UnicodeDecodeError:
        lines = []
    return lines[-1] if lines else "it is damaged"
