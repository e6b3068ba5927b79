"""Take an input file of Abaqus apart: keywords with parameters, and the lines behind each."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.numbers import NumberLines, parse_lines

COMMENT = re.compile(rb"^\*\*[^\n]*\n?", re.MULTILINE)
BEGIN = re.compile(rb"^[ \t]*\*", re.MULTILINE)

EMPTY = re.compile(rb",(?=[ \t]*,)")

DEEPEST = 10
"""Files that include each other, at most: some include themselves."""


@dataclass(frozen=True)
class Keyword:
    """A keyword.

    Attributes:
        name: In capitals, one blank between words.
        parameters: Names in capitals with their values, which may be empty.
        lines: What stands behind it, or in the file that it names.
    """

    name: str
    parameters: dict[str, str]
    lines: bytes


def keywords_of(path: Path, data: bytes, depth: int = 0) -> Iterator[Keyword]:
    """Yield the keywords of a file and of those that it includes, in their order.

    Raises:
        MeshFileError: It begins otherwise, or a file that it names cannot be read.
    """
    first, *chunks = BEGIN.split(COMMENT.sub(b"", data.replace(b"\r\n", b"\n")))
    if first.strip():
        shown = first.strip()[:40].decode("ascii", "replace")
        raise MeshFileError(f"{path}: {shown!r} was found where a keyword, such as *NODE, was expected")
    for chunk in chunks:
        head, _, lines = chunk.partition(b"\n")
        while head.rstrip().endswith(b",") and lines:
            more, _, lines = lines.partition(b"\n")
            head += more
        word, *parameters = head.decode("utf-8", "replace").split(",")
        pairs = (parameter.partition("=") for parameter in parameters)
        found = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
        name = " ".join(word.upper().split())
        if "INPUT" in found:
            place, lines = _named(path, found["INPUT"], depth)
            if name == "INCLUDE":
                yield from keywords_of(place, lines, depth + 1)
                continue
        yield Keyword(name, found, lines)


def number_lines(path: Path, text: bytes) -> NumberLines:
    """Return the numbers of lines with commas between; 0 where there is nothing between two commas."""
    spaced = EMPTY.sub(b",0", text).replace(b",", b" ")
    return parse_lines(str(path), np.frombuffer(spaced + b"\n", np.uint8))


def _named(path: Path, name: str, depth: int) -> tuple[Path, bytes]:
    """Return the place and the bytes of a file that another one names, relative to that."""
    if depth >= DEEPEST:
        raise MeshFileError(f"{path}: more than {DEEPEST} files include each other; expected an end")
    place = path.parent / name
    try:
        return place, place.read_bytes()
    except (OSError, ValueError) as error:
        raise MeshFileError(
            f"{path}: the file {name!r} that it names cannot be read ({error}); put it where it is expected"
        ) from error
