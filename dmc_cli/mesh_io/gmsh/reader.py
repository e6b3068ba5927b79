"""Read files of Gmsh of versions 2 and 4: triangles and quads with values, physical surfaces as groups."""

from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray, IntArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.gmsh.blocks import Block, read_elements, read_nodes
from dmc_cli.mesh_io.gmsh.groups import grouping_of, read_entities, read_names
from dmc_cli.mesh_io.gmsh.sections import Section, sections_of
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbered import node_places, places_among
from dmc_cli.mesh_io.parsed import FACES, make_mesh, other_cells, unread, usable_values

DATA = ("NodeData", "ElementData")
"""Sections of values: of nodes, of elements."""

UNREAD = ("ElementNodeData", "Periodic", "GhostElements", "Parametrizations")
"""Sections that are told and not read."""

WIDEST = 9
"""Numbers of a value: of a tensor."""


def read_gmsh(path: Path) -> MeshFile:
    """Read the triangles and quads of a .msh file with their values, in the order of its blocks.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: It has another version, or faces of another kind.
    """
    sections = sections_of(str(path), path.read_bytes())
    node_numbers, points = read_nodes(_one(path, sections, "Nodes"))
    is_new = sections[0].layout.version != "2.2"
    physical = [read_entities(s) for s in sections if s.name == "Entities" and is_new]
    blocks = read_elements(_one(path, sections, "Elements"), physical[0] if physical else {})
    told = other_cells(path, [(block.kind, len(block.numbers)) for block in blocks])
    faces = [block for block in blocks if block.kind in FACES and len(block.numbers)]
    nothing = np.zeros(0, np.int64)
    counts = np.concatenate([nothing, *(np.full(len(b.nodes), b.nodes.shape[1]) for b in faces)])
    corners = np.concatenate([nothing, *(block.nodes.ravel() for block in faces)])
    values = {
        name: usable_values(_values([s for s in sections if s.name == name], numbers, told), told)
        for name, numbers in zip(DATA, (node_numbers, _numbers(faces)), strict=True)
    }
    names = [read_names(section) for section in sections if section.name == "PhysicalNames"]
    told += [f"${name}" for name in UNREAD if any(section.name == name for section in sections)]
    comments = b"".join(section.remaining_text() for section in sections if section.name == "Comments")
    return make_mesh(
        str(path),
        points,
        counts,
        node_places(path, node_numbers, corners),
        comments,
        grouping_of(path, faces, names[0] if names else {}),
        vertex_values=values["NodeData"],
        face_values=values["ElementData"],
        warnings=unread(path, told),
    )


def _one(path: Path, sections: list[Section], name: str) -> Section:
    """Return the section of a name."""
    found = [section for section in sections if section.name == name]
    if len(found) != 1:
        raise MeshFileError(f"{path}: {len(found)} sections ${name} were found; expected one")
    return found[0]


def _numbers(blocks: list[Block]) -> IntArray:
    """Return the numbers of all elements."""
    return np.concatenate([np.zeros(0, np.int64), *(block.numbers for block in blocks)])


def _values(sections: list[Section], numbers: IntArray, told: list[str]) -> dict[str, AnyArray]:
    """Return the values of nodes or elements of such numbers; what only some have is told."""
    values: dict[str, AnyArray] = {}
    for section in sections:
        name, items, rows = _data(section)
        order = np.argsort(items, kind="stable")
        found = places_among(items[order], numbers)
        if ":" in name:  # numbers of parts, as meshio writes them
            continue
        if name in values or (found < 0).any():
            told.append(
                f"values {name} of some parts" if name not in values else f"values {name} of other times"
            )
        else:
            values[name] = rows[order][found]
    return values


def _data(section: Section) -> tuple[str, IntArray, AnyArray]:
    """Return the name of values, the numbers of what has them, and the values, (n, width)."""
    titles = [section.line().strip('"') for _ in range(section.whole())]
    for _ in range(section.whole()):
        section.line()  # times
    sizes = [section.whole() for _ in range(section.whole())]
    if not titles or len(sizes) < 3 or not 0 < sizes[1] <= WIDEST:
        raise section.damaged(
            f"the sizes {sizes[:4]} were found; expected a name, then step, width and count"
        )
    items, rows = section.rows(sizes[2], sizes[1])
    section.end()
    return titles[0], items, rows
