"""Make groups of the sets of elements of an input file of Abaqus, and of its instances."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import IntArray
from dmc_cli.mesh_io.abaqus.sets import Sets, faces_of
from dmc_cli.mesh_io.grouping import UNGROUPED, Grouping, by_sets, some_of


@dataclass(frozen=True)
class PlacedSets:
    """A part where an instance of it lies.

    Attributes:
        name: Of the instance, or empty.
        elements: Numbers of the part's faces, (F,).
        sets: Of the part and of the instance.
    """

    name: str
    elements: IntArray
    sets: Sequence[Sets]


def grouping_of(path: object, placed: Sequence[PlacedSets], told: list[str]) -> Grouping | None:
    """Return the groups of all faces, instance by instance; None without any.

    A name that several instances have a set of is told apart by the instance's, as in Left.Skull. Where there
    are sets or several instances, an instance's faces in no set are a group of its name.

    Args:
        path: The file, for messages.
        placed: The parts in the order of their faces.
        told: What is not read; sets of elements that are no faces are added.
    """
    missing: dict[str, int] = {}
    found = [list(_sets_of(each, told, missing)) for each in placed]
    if missing:
        told.append(f"{sum(missing.values())} elements that are no faces in the sets {some_of([*missing])}")
    several = Counter(title.upper() for sets in found for title in {title for title, _ in sets})
    is_one = sum(len(each.elements) > 0 for each in placed) < 2
    if is_one and not several:
        return None
    groups: dict[str, IntArray] = {}
    start = 0
    for each, sets in zip(placed, found, strict=True):
        left = np.ones(len(each.elements), bool)
        for title, faces in sets:
            left[faces] = False
            name = f"{each.name}.{title}" if several[title.upper()] > 1 and each.name else title
            groups[name] = np.concatenate([groups.get(name, np.zeros(0, np.int64)), start + faces])
        if left.any():
            rest = start + np.flatnonzero(left)
            name = each.name or UNGROUPED
            groups[name] = np.concatenate([groups.get(name, np.zeros(0, np.int64)), rest])
        start += len(each.elements)
    return by_sets(path, start, groups)


def _sets_of(each: PlacedSets, told: list[str], missing: dict[str, int]) -> Iterator[tuple[str, IntArray]]:
    """Yield the sets of a placed part that have faces, by their titles."""
    for sets in each.sets:
        for title, faces in faces_of(sets, each.elements, told, missing).items():
            if len(faces):
                yield title, faces
