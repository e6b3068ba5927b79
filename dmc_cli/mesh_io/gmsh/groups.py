"""Read the physical groups of a file of Gmsh: their names, and in version 4 which entities are in them."""

import re
from collections.abc import Mapping
from itertools import accumulate

import numpy as np

from dmc_cli.array_types import IntArray
from dmc_cli.mesh_io.gmsh.blocks import Block
from dmc_cli.mesh_io.gmsh.sections import Section
from dmc_cli.mesh_io.grouping import Grouping, by_sets, unique_names

NAME = re.compile(r'^[ \t]*(\d)[ \t]+(-?\d{1,10})[ \t]+"(.*)"[ \t\r]*$', re.MULTILINE)
"""Dimension, number and name of a group."""

SURFACE = 2
"""The dimension of faces."""


def read_names(section: Section) -> dict[int, str]:
    """Return the names of the physical surfaces by their numbers."""
    found = NAME.findall(section.remaining_text().decode("utf-8", "replace"))
    return {int(number): name for dimension, number, name in found if int(dimension) == SURFACE}


def read_entities(section: Section) -> dict[tuple[int, int], IntArray]:
    """Return the physical groups of points, curves, surfaces and volumes, by dimension and number.

    Raises:
        MeshFileError: The section is damaged.
    """
    found = {}
    for dimension, count in enumerate(section.sizes(4).tolist()):
        is_point = dimension == 0 and section.layout.version == "4.1"
        for _ in range(count):
            number = int(section.integers(1)[0])
            section.reals(1, 3 if is_point else 6)  # where it lies
            found[dimension, number] = np.abs(section.integers(int(section.sizes(1)[0])))
            if dimension:
                section.integers(int(section.sizes(1)[0]))  # what bounds it
    section.end()
    return found


def grouping_of(path: object, faces: list[Block], names: Mapping[int, str]) -> Grouping | None:
    """Return the physical surfaces of faces, in the order of their numbers; None without any."""
    rows = [(start, block.groups) for start, block in zip(_starts(faces), faces, strict=True)]
    columns = [(start, column) for start, groups in rows for column in groups.T]
    numbers = np.concatenate([np.zeros(0, np.int64), *(column for _, column in columns)])
    places = [start + np.arange(len(column)) for start, column in columns]
    where = np.concatenate([np.zeros(0, np.int64), *places])
    found = np.unique(numbers[numbers != 0]).tolist()
    titles = unique_names([names.get(number) or f"surface_{number}" for number in found])
    sets = {title: where[numbers == number] for number, title in zip(found, titles, strict=True)}
    return by_sets(path, sum(len(block.numbers) for block in faces), sets) if sets else None


def _starts(faces: list[Block]) -> list[int]:
    """Return the number of the first face of each block."""
    ends = accumulate(len(block.numbers) for block in faces)
    return [0, *ends][: len(faces)]
