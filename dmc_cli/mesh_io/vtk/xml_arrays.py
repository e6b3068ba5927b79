"""Get arrays out of VTK's XML: numbers as text, or bytes that are raw, base64, compressed in blocks.

Before the bytes of an array stands their number; before compressed ones the number of blocks, the size of a
block, the size of the last one, and what each takes compressed.
"""

import base64
import binascii
import lzma
import re
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, fromstring

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.numbers import parse_numbers

TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8",
    "UInt64": "u8", "Float32": "f4", "Float64": "f8", "String": "u1",
}  # fmt: skip
"""NumPy's letters for VTK's types; a text is its characters."""

BYTE_ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
COMPRESSORS: dict[str, Any] = {
    "vtkZLibDataCompressor": zlib.decompressobj,
    "vtkLZMADataCompressor": lzma.LZMADecompressor,
}


@dataclass(frozen=True)
class _Bytes:
    """Bytes as they stand in the file, or as base64."""

    path: Path
    text: bytes
    is_base64: bool

    def take(self, start: int, count: int) -> tuple[bytes, int]:
        """Return so many bytes, and where what follows them starts."""
        end = start + (-(-count // 3) * 4 if self.is_base64 else count)
        found = self.text[start:end]
        if self.is_base64:
            try:
                found = base64.b64decode(found, validate=True)[:count]
            except binascii.Error as error:
                raise MeshFileError(f"{self.path}: base64 was expected; {error}; it is damaged") from error
        if len(found) < count or start < 0:
            raise MeshFileError(
                f"{self.path}: an array ends early; {count} bytes were expected; it is cut off"
            )
        return found, end


class XmlFile:
    """A file of VTK's XML, taken apart.

    Attributes:
        path: The file, for messages.
        root: Its outermost element.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        data = path.read_bytes()
        mark = re.search(rb"""<AppendedData[^>]*encoding=["']raw["'][^>]*>\s*_""", data)
        xml = data if mark is None else data[: mark.end() - 1] + b"</AppendedData></VTKFile>"
        try:
            self.root = fromstring(xml)
        except (ParseError, LookupError, ValueError) as error:
            raise MeshFileError(f"{path}: XML of VTK was expected; {error}") from error
        order = BYTE_ORDERS.get(self.root.get("byte_order", "LittleEndian"))
        size = TYPES.get(self.root.get("header_type", "UInt32"), "")
        if self.root.tag != "VTKFile" or order is None or size not in ("u4", "u8"):
            raise MeshFileError(
                f"{path}: the element {self.root.tag} {self.root.attrib} was found; expected a VTKFile with"
                " byte_order LittleEndian or BigEndian and header_type UInt32 or UInt64"
            )
        self._order, self._size = order, np.dtype(order + size)
        compressor = self.root.get("compressor")
        if compressor is not None and compressor not in COMPRESSORS:
            raise UnsupportedFormatError(
                f"{path}: data compressed by {compressor} were found; expected {', '.join(COMPRESSORS)} or"
                " none; write it so"
            )
        self._compressor = None if compressor is None else COMPRESSORS[compressor]
        appended = self.root.find("AppendedData")
        if mark is not None:
            self._appended = _Bytes(path, data[mark.end() :], is_base64=False)
        else:
            text = (appended.text or "" if appended is not None else "").strip().removeprefix("_")
            self._appended = _Bytes(path, text.encode(), is_base64=True)

    def array(self, element: Element) -> AnyArray:
        """Return the numbers of a `DataArray`, in rows if it has several components."""
        found = self._numbers(element)
        columns = self.number(element, "NumberOfComponents", 1)
        if columns < 1 or found.size % columns:
            raise MeshFileError(
                f"{self.path}: {found.size} numbers of {element.get('Name')} were found; expected rows of"
                f" {columns}; it is damaged"
            )
        return found if columns == 1 else found.reshape(-1, columns)

    def number(self, element: Element, name: str, default: int = 0) -> int:
        """Return an attribute that is a whole number."""
        text = element.get(name) or str(default)
        if not text.strip().isdecimal():
            raise MeshFileError(f"{self.path}: {name} is {text!r}; expected a whole number")
        return int(text)

    def _numbers(self, element: Element) -> AnyArray:
        letters = TYPES.get(element.get("type", ""))
        if letters is None:
            raise UnsupportedFormatError(
                f"{self.path}: an array of the type {element.get('type')} was found; expected one of"
                f" {', '.join(TYPES)}"
            )
        dtype = np.dtype(self._order + letters)
        match element.get("format"):
            case "ascii":
                values = parse_numbers(str(self.path), (element.text or "").encode())
                with np.errstate(invalid="ignore", over="ignore"):
                    return values.astype(dtype.newbyteorder("="))
            case "binary":
                source = _Bytes(self.path, "".join((element.text or "").split()).encode(), is_base64=True)
                return self._typed(self._body(source, 0), dtype)
            case "appended":
                return self._typed(self._body(self._appended, self.number(element, "offset")), dtype)
        raise MeshFileError(
            f"{self.path}: an array's format is {element.get('format')!r}; expected ascii, binary or appended"
        )

    def _typed(self, body: bytes, dtype: np.dtype[Any]) -> AnyArray:
        if len(body) % dtype.itemsize:
            raise MeshFileError(f"{self.path}: {len(body)} bytes were found; expected numbers of {dtype}")
        return np.frombuffer(body, dtype).astype(dtype.newbyteorder("="))

    def _body(self, source: _Bytes, start: int) -> bytes:
        """Return the bytes of an array that starts somewhere."""
        if self._compressor is None:
            count = self._size_at(source, start)
            return source.take(start, self._size.itemsize + count)[0][self._size.itemsize :]
        blocks = self._size_at(source, start)
        head, start = source.take(start, (3 + blocks) * self._size.itemsize)
        _, size, last, *packed = np.frombuffer(head, self._size).tolist()
        body, _ = source.take(start, sum(packed))
        parts, end = [], 0
        for number, length in enumerate(packed, 1):
            most = last if last and number == blocks else size
            parts.append(self._unpacked(body[end : end + length], most))
            end += length
        return b"".join(parts)

    def _size_at(self, source: _Bytes, start: int) -> int:
        return int(np.frombuffer(source.take(start, self._size.itemsize)[0], self._size)[0])

    def _unpacked(self, block: bytes, size: int) -> bytes:
        """Return a block, which has so many bytes, decompressed."""
        assert self._compressor is not None
        try:
            found: bytes = self._compressor().decompress(block, max(min(size, 1 << 62), 1))
        except (zlib.error, lzma.LZMAError, EOFError) as error:
            raise MeshFileError(f"{self.path}: compressed data are damaged: {error}") from error
        if len(found) != size:
            raise MeshFileError(f"{self.path}: a block of {len(found)} bytes was found; expected {size}")
        return found
