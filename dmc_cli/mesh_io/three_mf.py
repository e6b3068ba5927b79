"""Write and read 3MF, the format of 3D printing: triangles in XML, in a zip of three files.

Its coordinates have a unit; each group is an object. The zip's times are fixed, so that the same mesh gives
the same bytes.
"""

import re
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any
from xml.etree.ElementTree import ParseError, XMLParser
from xml.sax.saxutils import quoteattr

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.grouping import Grouping
from dmc_cli.mesh_io.mesh_file import MeshFile, parts_of
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.mesh_io.text import chunks_of, framed_lines
from dmc_cli.mesh_io.triangles import triangle_chunks
from dmc_cli.volume import Color

UNITS = {"mm": ("millimeter", 1.0), "um": ("micron", 1.0), "nm": ("micron", 1e-3), "m": ("meter", 1.0)}
"""3MF's word for a unit, and its length in that; it knows no nanometres."""

LENGTHS = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1e3}
"""Length of 3MF's units in millimetres."""

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time of all files: the earliest that a zip knows."""

LEVEL = 1
"""How hard zlib tries: the hardest takes five times as long for a tenth."""

NAMESPACE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PACKAGE = "http://schemas.openxmlformats.org/package/2006"
MODEL = "3D/3dmodel.model"

TYPES = (
    f'<?xml version="1.0" encoding="UTF-8"?>\n<Types xmlns="{PACKAGE}/content-types">\n'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>\n'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>\n'
    "</Types>\n"
)
RELATIONS = (
    f'<?xml version="1.0" encoding="UTF-8"?>\n<Relationships xmlns="{PACKAGE}/relationships">\n'
    f'<Relationship Target="/{MODEL}" Id="rel0"'
    ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>\n</Relationships>\n'
)
VERTEX = (b'<vertex x="', b'" y="', b'" z="', b'"/>\n')
TRIANGLE = (b'<triangle v1="', b'" v2="', b'" v3="', b'"/>\n')
COLOR = re.compile(r"#(?:[0-9A-Fa-f]{6}|[0-9A-Fa-f]{8})")
LARGEST_LINE = 80
"""Bytes of a vertex or a triangle, at most."""


class _Sink:
    """Takes the bytes of a zip, which cannot go back in it, until they are handed on."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def write(self, data: Any) -> int:
        """Keep some bytes."""
        self._parts.append(bytes(data))
        return len(data)

    def flush(self) -> None:
        """Do nothing: there is nothing behind."""

    def taken(self) -> bytes:
        """Return the bytes since the last time."""
        parts, self._parts = self._parts, []
        return b"".join(parts)


def encode_3mf(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a 3MF file, quads split into triangles, an object for each group."""
    sink = _Sink()
    stream: Any = sink
    is_large = LARGEST_LINE * (len(mesh.points) + 2 * len(mesh.faces)) >= zipfile.ZIP64_LIMIT
    with zipfile.ZipFile(stream, "w") as archive:
        for name, text in (("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS)):
            with archive.open(_entry(name), "w") as member:
                member.write(text.encode("ascii"))
        with archive.open(_entry(MODEL), "w", force_zip64=is_large) as member:
            for piece in _model(mesh):
                member.write(piece)
                yield sink.taken()
    yield sink.taken()


def _entry(name: str) -> zipfile.ZipInfo:
    """Return the entry of a file in the zip."""
    entry = zipfile.ZipInfo(name, EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry._compresslevel = LEVEL  # type: ignore[attr-defined]
    return entry


def _model(mesh: MeshFile) -> Iterator[bytes]:
    """Yield the XML of the model."""
    unit, length = UNITS[mesh.unit]
    space = "" if mesh.space == "none" else f'<metadata name="Description">SPACE={mesh.space}</metadata>\n'
    yield (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<model unit="{unit}" xml:lang="en-US" xmlns="{NAMESPACE}">\n'
        f'<metadata name="Application">dmc</metadata>\n{space}<resources>\n'
    ).encode("ascii")
    numbers: list[int] = []
    materials = 0
    for name, part in parts_of(mesh, "mesh"):
        painted = ""
        if part.color is not None:
            materials += 1
            number = len(numbers) + materials
            painted = f' pid="{number}" pindex="0"'
            yield _material(number, name, part.color)
        numbers.append(len(numbers) + materials + 1)
        told = f'id="{numbers[-1]}" type="model" name={quoteattr(name)}{painted}'
        yield f"<object {told}>\n<mesh>\n<vertices>\n".encode()
        for points in chunks_of(part.points, np.float32):
            yield framed_lines(points, VERTEX)
        yield b"</vertices>\n<triangles>\n"
        for triangles in triangle_chunks(part):
            yield framed_lines(triangles, TRIANGLE)
        yield b"</triangles>\n</mesh>\n</object>\n"
    move = "" if length == 1 else f' transform="{length:g} 0 0 0 {length:g} 0 0 0 {length:g} 0 0 0"'
    items = "".join(f'<item objectid="{number}"{move}/>\n' for number in numbers)
    yield f"</resources>\n<build>\n{items}</build>\n</model>\n".encode("ascii")


def _material(number: int, name: str, color: Color) -> bytes:
    """Return a material of one colour."""
    shown = "#{:02X}{:02X}{:02X}".format(*color)
    base = f'<base name={quoteattr(name)} displaycolor="{shown}"/>'
    return f'<basematerials id="{number}">\n{base}\n</basematerials>\n'.encode()


def read_3mf(path: Path) -> MeshFile:
    """Read the objects that a 3MF file builds as groups of one mesh, in millimetres.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: An object is put together of others.
    """
    try:
        with zipfile.ZipFile(path) as archive, archive.open(MODEL) as stream:
            return _read(path, stream)
    except (
        zipfile.BadZipFile,
        zlib.error,
        KeyError,
        ParseError,
        EOFError,
        OSError,
        NotImplementedError,
    ) as error:
        raise MeshFileError(f"{path}: a zip with {MODEL} was expected; {error}; it is damaged") from error
    except (ValueError, OverflowError) as error:
        if isinstance(error, MeshFileError | UnsupportedFormatError):
            raise
        raise MeshFileError(f"{path}: a number was expected in {MODEL}; {error}") from error


def _read(path: Path, stream: IO[bytes]) -> MeshFile:
    """Read the model."""
    model = _Model(path)
    parser = XMLParser(target=model)
    while piece := stream.read(1 << 20):
        parser.feed(piece)
    parser.close()
    if model.unit not in LENGTHS:
        raise MeshFileError(
            f"{path}: the unit {model.unit!r} was found; expected one of {', '.join(LENGTHS)}"
        )
    points, corners, start = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    names: list[str] = []
    colors: dict[int, Color] = {}
    for number, item in enumerate(model.items):
        places, found = model.objects[item.get("objectid")]
        if found.size and not 0 <= found.min() <= found.max() < len(places):
            raise MeshFileError(
                f"{path}: a triangle names a vertex outside 0 to {len(places) - 1}; expected one that is"
                " there; it is damaged"
            )
        points.append(_placed(item, places, LENGTHS[model.unit]))
        corners.append(found + start)
        start += len(places)
        name, color = model.looks(item.get("objectid"))
        names.append(name or f"part_{number + 1}")
        colors |= {} if color is None else {number: color}
    counts = [len(found) for found in corners[1:]]
    faces = np.concatenate(corners)
    return make_mesh(
        str(path),
        np.concatenate(points),
        np.full(len(faces), 3),
        faces.ravel(),
        model.text.encode("ascii", "replace") + b"\n",
        Grouping(names=names, numbers=np.repeat(np.arange(len(names)), counts), colors=colors),
        warnings=unread(path, sorted(model.told)),
    )


class _Model:
    """Takes the elements of a model as they are read, and keeps what a mesh needs.

    Attributes:
        unit: 3MF's word for the unit.
        objects: Vertices, (V, 3), and triangles, (F, 3), of each object.
        attributes: What the file says of each object: its name, and the material of all of it.
        materials: The colours of each list of materials.
        items: What is built: attributes with the object's number and where it lies.
        told: What was found and is not read.
        text: What stands between the elements of its description.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.unit, self.text = "millimeter", ""
        self.objects: dict[str | None, tuple[AnyArray, AnyArray]] = {}
        self.attributes: dict[str | None, dict[str, str]] = {}
        self.materials: dict[str, list[Color | None]] = {}
        self.items: list[dict[str, str]] = []
        self.told: set[str] = set()
        self._number: str | None = None
        self._material = ""
        self._vertices: list[float] = []
        self._corners: list[int] = []
        self._is_described = False

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Take the beginning of an element."""
        name = tag.rpartition("}")[2]
        if name == "vertex":
            self._vertices += (float(attributes["x"]), float(attributes["y"]), float(attributes["z"]))
        elif name == "triangle":
            self._corners += (int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"]))
            if "p1" in attributes:
                self.told.add("colours of triangles")
        elif name == "model":
            self.unit = attributes.get("unit", self.unit)
        elif name == "object":
            self._number = attributes.get("id")
            self.attributes[self._number] = attributes
        elif name == "item":
            self.items.append(attributes)
        elif name == "metadata":
            self._is_described = attributes.get("name") == "Description"
        elif name == "basematerials":
            self._material = attributes.get("id", "")
            self.materials[self._material] = []
        elif name == "base" and self._material in self.materials:
            self.materials[self._material].append(_color(attributes.get("displaycolor", "")))
        elif name in ("colorgroup", "texture2d"):
            self.told.add("colours and textures")
        elif name == "component":
            raise UnsupportedFormatError(
                f"{self.path}: an object put together of others was found; expected meshes alone; write it so"
            )

    def looks(self, number: str | None) -> tuple[str, Color | None]:
        """Return the name and the colour of an object."""
        found = self.attributes[number]
        bases = self.materials.get(found.get("pid", ""), [])
        index = found.get("pindex", "0")
        color = bases[int(index)] if index.isdecimal() and int(index) < len(bases) else None
        return found.get("name", ""), color

    def end(self, tag: str) -> None:
        """Take the end of an element."""
        name = tag.rpartition("}")[2]
        if name == "object":
            vertices = np.array(self._vertices, float).reshape(-1, 3)
            self.objects[self._number] = vertices, np.array(self._corners, np.int64).reshape(-1, 3)
            self._vertices, self._corners = [], []
        elif name == "metadata":
            self._is_described = False

    def data(self, text: str) -> None:
        """Take a text."""
        if self._is_described:
            self.text += text

    def close(self) -> None:
        """Do nothing: all has been taken."""


def _color(shown: str) -> Color | None:
    """Return a colour of sRGB, as in #FF8000 or, with its opacity, #FF8000FF."""
    if not COLOR.fullmatch(shown):
        return None
    return int(shown[1:3], 16), int(shown[3:5], 16), int(shown[5:7], 16)


def _placed(item: dict[str, str], places: AnyArray, length: float) -> AnyArray:
    """Return an object's positions where it is built, in millimetres."""
    matrix = np.eye(4, 3)
    if "transform" in item:
        matrix = np.array(item["transform"].split(), float).reshape(4, 3)
    placed: AnyArray = (places @ matrix[:3] + matrix[3]) * length
    return placed
