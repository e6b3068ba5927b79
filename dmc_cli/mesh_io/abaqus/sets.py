"""Take the sets of elements of an input file of Abaqus: numbers, ranges of them, and names of other sets."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dmc_cli.array_types import IntArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.abaqus.keywords import Keyword, number_lines
from dmc_cli.mesh_io.numbered import places_among
from dmc_cli.mesh_io.numbers import whole_numbers

WORD = re.compile(rb"[A-Za-z_]")


@dataclass
class ElementSet:
    """Elements of a part, by numbers that it need not have.

    Attributes:
        title: The name, as it is written first.
        numbers: Of elements, (n,) each.
        ranges: First, last and step, (n, 3) each.
        others: Names of sets whose elements are in this one, too, in capitals.
    """

    title: str
    numbers: list[IntArray] = field(default_factory=list)
    ranges: list[IntArray] = field(default_factory=list)
    others: list[str] = field(default_factory=list)


Sets = dict[str, ElementSet]
"""The sets of a part, by their names in capitals: Abaqus tells no capitals from small letters."""


def set_of(sets: Sets, title: str) -> ElementSet:
    """Return the set of a name, a new one if there is none yet."""
    return sets.setdefault(title.upper(), ElementSet(title))


def take_set(path: Path, keyword: Keyword, sets: Sets) -> None:
    """Take what a keyword *ELSET adds to a set; those that Abaqus/CAE keeps for itself are passed over.

    Raises:
        MeshFileError: It has no name, or what stands behind it is no element.
    """
    if "INTERNAL" in keyword.parameters:
        return
    if not keyword.parameters.get("ELSET"):
        raise MeshFileError(f"{path}: *ELSET without a name was found; expected one, such as ELSET=SKULL")
    found = set_of(sets, keyword.parameters["ELSET"])
    if "GENERATE" in keyword.parameters:
        found.ranges.append(_ranges(path, keyword))
        return
    text = keyword.lines
    if WORD.search(text):
        words = [word.strip() for line in text.splitlines() for word in line.split(b",")]
        found.others += [
            word.decode("utf-8", "replace").strip('"').upper() for word in words if WORD.search(word)
        ]
        text = b"\n".join(word for word in words if not WORD.search(word))
    found.numbers.append(whole_numbers(str(path), number_lines(path, text.replace(b",", b" ")).values))


def _ranges(path: Path, keyword: Keyword) -> IntArray:
    """Return first, last and step of ranges, (n, 3); the step may be left out."""
    lines = number_lines(path, keyword.lines)
    values = whole_numbers(str(path), lines.values)
    rows = np.ones((len(lines.counts), 3), np.int64)
    fits = np.isin(lines.counts, (2, 3))
    for column in range(3):
        has = lines.counts > column
        rows[has, column] = values[lines.starts[has] + column]
    rows[rows[:, 2] == 0, 2] = 1  # nothing between commas
    if not fits.all() or (rows[:, 1] < rows[:, 0]).any() or (rows[:, 2] < 1).any():
        raise MeshFileError(
            f"{path}: a range of elements with {lines.counts[:3].tolist()} numbers was found; expected first,"
            " last and step; it is damaged"
        )
    return rows


def faces_of(
    sets: Mapping[str, ElementSet], elements: IntArray, told: list[str], missing: dict[str, int]
) -> dict[str, IntArray]:
    """Return the faces of each set by its title.

    Args:
        sets: Of a part, by their names in capitals.
        elements: The numbers of the part's faces, (F,); each is there once.
        told: What is not read: sets that are not there are added.
        missing: How many elements of sets are no faces, by the titles of these: is added to.
    """
    order = np.argsort(elements, kind="stable")
    ordered = elements[order]
    found = {}
    for name, chosen in sets.items():
        absent = 0
        faces = [np.zeros(0, np.int64)]
        for member in _with_others(name, sets, told):
            for numbers in member.numbers:
                places = places_among(ordered, numbers)
                faces.append(places[places >= 0])
                absent += int((places < 0).sum())
            for first, last, step in np.concatenate([np.zeros((0, 3), np.int64), *member.ranges]).tolist():
                start, stop = np.searchsorted(ordered, (first, last + 1))
                inside = start + np.flatnonzero((ordered[start:stop] - first) % step == 0)
                faces.append(inside)
                absent += (last - first) // step + 1 - len(inside)
        if absent:
            missing[chosen.title] = absent
        found[chosen.title] = order[np.concatenate(faces)]
    return found


def _with_others(name: str, sets: Mapping[str, ElementSet], told: list[str]) -> Iterator[ElementSet]:
    """Yield a set and those that are in it, each once."""
    waiting, seen = [name], set()
    while waiting:
        here = waiting.pop()
        if here in seen:
            continue
        seen.add(here)
        if here in sets:
            yield sets[here]
            waiting += reversed(sets[here].others)
        else:
            told.append(f"the set {here} in the set {sets[name].title}, which is none")
