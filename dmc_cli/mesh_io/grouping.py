"""Put the faces of a file into its groups: one after the other, whatever order they stand in.

A group without faces is none. Neither is one alone that has but a default name: it tells nothing. Faces in no
group are one of their own where others are in some.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any

import numpy as np

from dmc_cli.array_types import Int32Array, IntArray
from dmc_cli.notices import Notice
from dmc_cli.volume import Color

UNGROUPED = "ungrouped"
"""What faces in no group are called."""

DEFAULT_NAME = re.compile(r"(?:mesh|default|(?:part|property|reference|surface)_\d+)", re.IGNORECASE)
"""Names that tell nothing: of the whole mesh, OBJ's own, and those made of a number."""

MOST_NAMES = 10
"""In a message."""

CONTROL = re.compile(r"[\x00-\x1f\x7f]")


@dataclass(frozen=True, kw_only=True)
class Grouping:
    """The groups of a file.

    Attributes:
        names: Of the groups, in the order that they get; equal ones are told apart by a number behind.
        numbers: Which one each face is in, (F,), from 0; -1 for none.
        colors: Colours of groups by their numbers.
        notices: What is told of them.
    """

    names: Sequence[str]
    numbers: IntArray
    colors: Mapping[int, Color] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()

    def arranged(self, faces: Int32Array, more: dict[str, Any]) -> tuple[Int32Array, dict[str, Any]]:
        """Return faces, (F, 4), and what else `MeshFile` takes, with those of a group one after the other."""
        more = more | {"warnings": (*more.get("warnings", ()), *self.notices)}
        names = unique_names([*map(_plain, self.names), UNGROUPED])
        numbers = np.where(self.numbers < 0, len(self.names), self.numbers)
        counts = np.bincount(numbers, minlength=len(names)).tolist()
        used = [number for number, count in enumerate(counts) if count]
        colors = {number: color for number, color in self.colors.items() if counts[number]}
        if used in ([], [len(self.names)]):
            return faces, more
        if len(used) == 1 and DEFAULT_NAME.fullmatch(names[used[0]]):
            return faces, more | {"color": colors.get(used[0])}
        if (numbers[1:] < numbers[:-1]).any():
            order = np.argsort(numbers, kind="stable")
            faces = faces[order]
            values = more.get("face_values", {})
            more["face_values"] = {name: array[order] for name, array in values.items()}
        more["groups"] = {names[number]: counts[number] for number in used}
        more["colors"] = {names[number]: color for number, color in colors.items()}
        return faces, more


def unique_names(names: Sequence[str]) -> list[str]:
    """Return names of which each is there once, a number behind those that were there before."""
    last: dict[str, int] = {}
    found: list[str] = []
    for name in names:
        unique = name
        while unique in last:
            last[name] += 1
            unique = f"{name}_{last[name]}"
        last[unique] = 1
        found.append(unique)
    return found


def some_of(names: Sequence[str]) -> str:
    """Return the first names for a message, and how many more there are."""
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _plain(name: str) -> str:
    """Return a name without line ends and the like, and without blanks at its ends."""
    return CONTROL.sub("_", name.strip()) or "part_0"


def by_numbers(parts: IntArray, names: Mapping[int, str], word: str) -> Grouping:
    """Return the groups of faces that have a number of their part each, in the order of these.

    Args:
        parts: The number of each face's part, (F,); any.
        names: Names of parts, of some or all.
        word: What parts without a name are called, with their number behind.
    """
    found, numbers = np.unique(parts, return_inverse=True)
    titles = [names.get(number) or f"{word}_{number}" for number in found.tolist()]
    return Grouping(names=titles, numbers=numbers.reshape(-1))


def by_sets(path: object, count: int, sets: Mapping[str, IntArray]) -> Grouping:
    """Return the groups of faces that are in sets; where these overlap, the first counts, and it is told.

    A set of all faces comes last, so that others count before it.

    Args:
        path: The file, for messages.
        count: Number of faces.
        sets: Faces of each set, from 0, in the file's order.
    """
    members = {name: _each_once(faces) for name, faces in sets.items() if len(faces)}
    names = sorted(members, key=lambda name: len(members[name]) == count)
    numbers = np.full(count, -1)
    times = np.zeros(count, np.int64)
    for number, name in reversed([*enumerate(names)]):
        numbers[members[name]] = number
        times[members[name]] += 1
    several = np.flatnonzero(times > 1)
    told: tuple[Notice, ...] = ()
    if several.size:
        shared = [name for name in names if (times[members[name]] > 1).any()]
        sentence = (
            f"{PurePath(str(path)).name}: {several.size} faces are in several groups; each stays in the first"
            f" of {some_of(shared)}"
        )
        told = (Notice("W-GROUPS-OVERLAP", sentence),)
    return Grouping(names=names, numbers=numbers, notices=told)


def _each_once(faces: IntArray) -> IntArray:
    """Return faces in their order, each once; most are so already, and sorting takes long."""
    return faces if (faces[1:] > faces[:-1]).all() else np.unique(faces)
