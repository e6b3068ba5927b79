"""Read the triangles and quads of an input file of Abaqus: all parts as one, where their instances lie.

Each part numbers its nodes for itself; what stands in none is a part, too.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dmc_cli.array_types import Float64Array, IntArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.abaqus.groups import PlacedSets, grouping_of
from dmc_cli.mesh_io.abaqus.keywords import Keyword, keywords_of, number_lines
from dmc_cli.mesh_io.abaqus.kinds import kind_of
from dmc_cli.mesh_io.abaqus.sets import Sets, set_of, take_set
from dmc_cli.mesh_io.joined import Piece, joined
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbered import node_places
from dmc_cli.mesh_io.numbers import whole_numbers
from dmc_cli.mesh_io.parsed import make_mesh, other_cells, unread

HEAD = 2048
"""Bytes of a file that may name the space and the unit in a comment."""

MAKING = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")
"""Keywords that make nodes and elements of others, or put them elsewhere."""

CORNERS = {"triangle": 3, "quad": 4}

CONTINUED = re.compile(rb",[ \t]*\n")


@dataclass
class _Part:
    """Nodes and elements with numbers of their own.

    Attributes:
        numbers, points: Of the nodes, (n,) and (n, 3), a keyword each.
        elements: Number and nodes of the elements, (n, 1 + k), a keyword each.
        sets: Of elements.
    """

    numbers: list[IntArray] = field(default_factory=list)
    points: list[Float64Array] = field(default_factory=list)
    elements: list[IntArray] = field(default_factory=list)
    sets: Sets = field(default_factory=dict)

    @property
    def element_numbers(self) -> IntArray:
        """Return the numbers of all elements."""
        return np.concatenate([np.zeros(0, np.int64), *(rows[:, 0] for rows in self.elements)])


@dataclass(frozen=True)
class _Instance:
    """Where a part lies: moved, then turned.

    Attributes:
        name: As the file has it; empty for what lies where it is.
        part: Its part's name, in capitals.
        rows: Shift, and the two points of an axis with an angle in degrees; or less.
        sets: What the assembly takes of its elements.
    """

    name: str
    part: str
    rows: list[list[float]]
    sets: Sets = field(default_factory=dict)

    def placed(self, points: Float64Array) -> Float64Array:
        """Return positions, (n, 3), where the instance lies."""
        if self.rows:
            points = points + np.array(self.rows[0])
        return self._turned(points) if len(self.rows) > 1 else points

    def _turned(self, points: Float64Array) -> Float64Array:
        """Return positions turned round the axis, by the formula of Rodrigues."""
        start, end, angle = np.array(self.rows[1][:3]), np.array(self.rows[1][3:6]), self.rows[1][6]
        axis = (end - start) / np.linalg.norm(end - start)
        cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        arms = points - start
        turned = cosine * arms + sine * np.cross(axis, arms) + (1 - cosine) * np.outer(arms @ axis, axis)
        found: Float64Array = start + turned
        return found


def read_abaqus(path: Path) -> MeshFile:
    """Read the triangles and quads of an input file.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: Faces of another kind, or nodes and elements that keywords make.
    """
    data = path.read_bytes()
    parts: dict[str, _Part] = {"": _Part()}
    instances: list[_Instance] = []
    cells: list[tuple[str, int]] = []
    here = ""
    for keyword in keywords_of(path, data):
        if keyword.name == "PART":
            here = keyword.parameters.get("NAME", "").upper()
            parts.setdefault(here, _Part())
        elif keyword.name == "END PART":
            here = ""
        elif keyword.name == "INSTANCE":
            instances.append(_instance(path, keyword))
        elif keyword.name == "NODE":
            _take_nodes(path, keyword, parts[here])
        elif keyword.name == "ELEMENT":
            cells.append(_take_elements(path, keyword, parts[here]))
        elif keyword.name == "ELSET":
            take_set(path, keyword, _sets_for(keyword, parts[here], instances))
        elif keyword.name in MAKING and keyword.lines.strip():
            raise UnsupportedFormatError(
                f"{path}: *{keyword.name} was found; expected all nodes and elements as they are; write"
                " them so"
            )
    told = other_cells(path, cells)
    names = {instance.part for instance in instances}
    if not names <= parts.keys():
        raise MeshFileError(
            f"{path}: an instance of the part {min(names - parts.keys())} was found, which is none"
        )
    bare = [_Instance(name, name, []) for name in parts if not name or not instances]
    places = bare + instances
    found = joined(str(path), [_piece(path, parts[place.part], place) for place in places], set())
    contents = [
        PlacedSets(place.name, parts[place.part].element_numbers, [parts[place.part].sets, place.sets])
        for place in places
    ]
    found |= {"comments": data[:HEAD], "grouping": grouping_of(path, contents, told)}
    return make_mesh(str(path), **found, warnings=unread(path, told))


def _sets_for(keyword: Keyword, part: _Part, instances: list[_Instance]) -> Sets:
    """Return the sets that one belongs to: those of its part, or of the instance that it names."""
    name = keyword.parameters.get("INSTANCE", "").upper()
    return next((found.sets for found in instances if name and found.name.upper() == name), part.sets)


def _take_nodes(path: Path, keyword: Keyword, part: _Part) -> None:
    """Take nodes: number, coordinates, of which the last may be left out, and perhaps a normal."""
    if keyword.parameters.get("SYSTEM", "R").upper() != "R":
        raise UnsupportedFormatError(
            f"{path}: nodes in another system than the rectangular one were found; write them in that"
        )
    lines = number_lines(path, keyword.lines.lower().replace(b"d", b"e"))
    if not lines.counts.size:
        return
    width = int(lines.counts[0])
    if (lines.counts != width).any() or not 2 <= width <= 7:
        raise MeshFileError(
            f"{path}: nodes with {sorted(set(lines.counts.tolist()))} numbers were found; expected as many in"
            " each line of a block, two to seven; it is damaged"
        )
    rows = lines.values.reshape(-1, width)
    points = np.zeros((len(rows), 3))
    points[:, : min(width - 1, 3)] = rows[:, 1:4]
    part.numbers.append(whole_numbers(str(path), rows[:, 0]))
    part.points.append(points)


def _take_elements(path: Path, keyword: Keyword, part: _Part) -> tuple[str, int]:
    """Take elements if they are triangles or quads; return their kind and how many there are."""
    if "TYPE" not in keyword.parameters:
        raise MeshFileError(f"{path}: *ELEMENT without a TYPE was found; expected one, such as S4R")
    kind = kind_of(keyword.parameters["TYPE"].upper())
    if kind not in CORNERS:
        joined_lines = CONTINUED.sub(b",", keyword.lines)
        return kind, sum(not line.isspace() for line in joined_lines.splitlines())
    width = 1 + CORNERS[kind]
    lines = number_lines(path, keyword.lines)
    if (lines.counts != width).any():
        lines = number_lines(path, CONTINUED.sub(b",", keyword.lines))
    if (lines.counts != width).any():
        raise MeshFileError(
            f"{path}: a {kind} of {lines.counts[lines.counts != width][0]} numbers was found; expected its"
            f" own and {CORNERS[kind]} of nodes; it is damaged"
        )
    rows = whole_numbers(str(path), lines.values.reshape(-1, width))
    part.elements.append(rows)
    if keyword.parameters.get("ELSET"):
        set_of(part.sets, keyword.parameters["ELSET"]).numbers.append(rows[:, 0])
    return kind, len(lines.counts)


def _instance(path: Path, keyword: Keyword) -> _Instance:
    """Return where an instance lies."""
    lines = number_lines(path, keyword.lines)
    rows = [row.tolist() for row in np.split(lines.values, lines.starts[1:])] if lines.counts.size else []
    fits = [len(row) for row in rows] in ([], [3], [3, 7]) and bool(np.isfinite(lines.values).all())
    if not fits or (len(rows) == 2 and rows[1][:3] == rows[1][3:6]):
        raise MeshFileError(
            f"{path}: an instance with {[len(row) for row in rows]} numbers was found; expected three of a"
            " shift, then perhaps seven of an axis and an angle; it is damaged"
        )
    parameters = keyword.parameters
    return _Instance(parameters.get("NAME", ""), parameters.get("PART", "").upper(), rows)


def _piece(path: Path, part: _Part, instance: _Instance) -> Piece:
    """Return the mesh of a part where an instance of it lies."""
    nothing = np.zeros(0, np.int64)
    numbers = np.concatenate([nothing, *part.numbers])
    points = np.concatenate([np.zeros((0, 3)), *part.points])
    elements = part.element_numbers
    if len(np.unique(elements)) < len(elements):
        raise MeshFileError(f"{path}: two elements of a part have one number; expected numbers of their own")
    corners = np.concatenate([nothing, *(rows[:, 1:].ravel() for rows in part.elements)])
    counts = np.concatenate([nothing, *(np.full(len(rows), rows.shape[1] - 1) for rows in part.elements)])
    return Piece(instance.placed(points), counts, node_places(path, numbers, corners))
