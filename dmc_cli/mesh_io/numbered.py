"""Number nodes and elements from 1, find them by their numbers, and name parts, as formats of solvers do.

An element has the number of its face, whatever comes first in the file; triangles and quads stand apart.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import Int32Array, IntArray
from dmc_cli.errors import MeshFileError, WriteError
from dmc_cli.mesh_io.mesh_file import NO_CORNER, MeshFile
from dmc_cli.mesh_io.text import chunks_of

LONGEST_NAME = 64
"""Characters of a name; Abaqus takes 80, and there are words before ours."""


@dataclass(frozen=True)
class Part:
    """Faces that follow each other.

    Attributes:
        number: From 1.
        title: Its name, without line ends and quotes.
        name: The same as solvers take it: a letter, then letters, digits and _.
        first: The number of its first face, from 0.
        faces: Their corners, (n, 4).
    """

    number: int
    title: str
    name: str
    first: int
    faces: Int32Array

    def count(self, corners: int) -> int:
        """Return the number of faces with so many corners."""
        return int(np.count_nonzero((self.faces[:, 3] == NO_CORNER) == (corners == 3)))

    def rows(self, corners: int) -> Iterator[Int32Array]:
        """Yield element and nodes, both from 1, of faces with so many corners: chunks of (n, 1 + corners)."""
        start = self.first + 1
        for faces in chunks_of(self.faces):
            numbers = np.arange(start, start + len(faces), dtype=np.int32)
            chosen = (faces[:, 3] == NO_CORNER) == (corners == 3)
            if chosen.any():
                yield np.column_stack([numbers[chosen], faces[chosen, :corners] + np.int32(1)])
            start += len(faces)


def numbered_parts(mesh: MeshFile) -> list[Part]:
    """Return the groups of a mesh, or one part of all faces."""
    parts: list[Part] = []
    start = 0
    groups = mesh.groups or {"mesh": len(mesh.faces)}
    names = solver_names(list(groups))
    for number, (title, count) in enumerate(groups.items(), 1):
        plain = re.sub(r"[\x00-\x1f\x7f\"]", "_", title)
        faces = mesh.faces[start : start + count]
        parts.append(Part(number, plain, names[number - 1], start, faces))
        start += count
    return parts


def solver_names(names: list[str]) -> list[str]:
    """Return names that solvers take: a letter, then letters, digits and _; different, whatever the case."""
    found: list[str] = []
    for name in names:
        word = re.sub(r"[^A-Za-z0-9_]", "_", name)[:LONGEST_NAME]
        word = word if word[:1].isalpha() else f"part_{word}"
        taken, number, unique = {other.lower() for other in found}, 1, word
        while unique.lower() in taken:
            number += 1
            unique = f"{word}_{number}"
        found.append(unique)
    return found


def check_numbers(mesh: MeshFile, title: str, most: int) -> None:
    """Raise WriteError if there are more vertices or faces than a format has numbers for."""
    count = max(len(mesh.points), len(mesh.faces))
    if count > most:
        raise WriteError(
            f"a {title} file of {count} nodes or elements cannot be written: its numbers go to {most}; choose"
            " another format, such as .msh, or make the mesh smaller"
        )


def node_places(path: object, numbers: IntArray, wanted: IntArray) -> IntArray:
    """Return the place of each wanted node among those of a file, which have their numbers in any order.

    Raises:
        MeshFileError: One is not there, or two have one number.
    """
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    twice = np.flatnonzero(ordered[1:] == ordered[:-1])
    if twice.size:
        raise MeshFileError(f"{path}: there are two nodes {ordered[twice[0]]}; expected numbers of their own")
    found = places_among(ordered, wanted)
    if (found < 0).any():
        raise MeshFileError(
            f"{path}: an element names the node {wanted[found < 0][0]}; expected one of the {len(numbers)}"
            " that are there"
        )
    places: IntArray = order[found]
    return places


def places_among(ordered: IntArray, wanted: IntArray) -> IntArray:
    """Return the place of numbers among others that rise, -1 where one is not there."""
    if not len(ordered):
        return np.full(len(wanted), -1)
    places = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
    return np.where(ordered[places] == wanted, places, -1)
