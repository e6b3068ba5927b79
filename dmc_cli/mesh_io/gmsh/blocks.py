"""Read nodes and elements of the versions 2.2, 4.0 and 4.1 of Gmsh's format: numbers, and what they are of.

Numbers need be in no order, and may leave some out.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import Float64Array, IntArray
from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.mesh_io.gmsh.kinds import KINDS
from dmc_cli.mesh_io.gmsh.sections import Section
from dmc_cli.mesh_io.numbers import parse_lines, whole_numbers


@dataclass(frozen=True)
class Block:
    """Elements of one kind.

    Attributes:
        kind: Its name.
        numbers: Of the elements, (n,) int64.
        nodes: The numbers of their nodes, (n, k) int64.
        groups: The numbers of their physical groups, (n, g) int64; 0 is none.
    """

    kind: str
    numbers: IntArray
    nodes: IntArray
    groups: IntArray


def read_nodes(section: Section) -> tuple[IntArray, Float64Array]:
    """Return the numbers of the nodes, (V,) int64, and where they lie, (V, 3).

    Raises:
        MeshFileError: The section is damaged.
    """
    version = section.layout.version
    if version == "2.2":
        count = section.whole()
        numbers, points = section.rows(count, 3)
    else:
        blocks, count, *_ = section.sizes(4 if version == "4.1" else 2).tolist()
        found = [_node_block(section) for _ in range(blocks)]
        numbers = np.concatenate([np.zeros(0, np.int64), *(block for block, _ in found)])
        points = np.concatenate([np.zeros((0, 3)), *(block for _, block in found)])
    section.end()
    if len(numbers) != count:
        raise section.damaged(f"{len(numbers)} nodes were found; expected {count}, as many as it announces")
    return numbers, points


def _node_block(section: Section) -> tuple[IntArray, Float64Array]:
    """Return numbers and places of the nodes of a point, a curve, a surface or a volume."""
    first, second, is_parametric = section.integers(3).tolist()
    count = int(section.sizes(1)[0])
    if section.layout.version == "4.0":
        parameters = second if is_parametric else 0
    else:
        parameters = first if is_parametric else 0
    if not 0 <= parameters <= 3:
        raise section.damaged(f"a dimension of {parameters} was found; expected 0 to 3")
    if section.layout.version == "4.0":
        numbers, places = section.rows(count, 3 + parameters)
    else:
        numbers, places = section.sizes(count), section.reals(count, 3 + parameters)
    return numbers, places[:, :3]


def read_elements(section: Section, physical: Mapping[tuple[int, int], IntArray]) -> list[Block]:
    """Return the elements in blocks of one kind.

    Args:
        section: What holds them.
        physical: In version 4, the physical groups of each entity, by its dimension and number.

    Raises:
        MeshFileError: The section is damaged.
        UnsupportedFormatError: A kind is unknown.
    """
    version = section.layout.version
    if version == "2.2":
        count = section.whole()
        blocks = list(_binary_elements(section, count) if section.layout.order else _element_lines(section))
    else:
        announced, count, *_ = section.sizes(4 if version == "4.1" else 2).tolist()
        blocks = [_element_block(section, physical) for _ in range(announced)]
        section.end()
    found = sum(len(block.numbers) for block in blocks)
    if found != count:
        raise section.damaged(f"{found} elements were found; expected {count}, as many as it announces")
    return blocks


def _element_block(section: Section, physical: Mapping[tuple[int, int], IntArray]) -> Block:
    """Return the elements of a point, a curve, a surface or a volume."""
    first, second, number = section.integers(3).tolist()
    entity = (second, first) if section.layout.version == "4.0" else (first, second)
    count = int(section.sizes(1)[0])
    kind, width = _kind(section, number)
    take = section.integers if section.layout.version == "4.0" else section.sizes
    rows = take(count * (1 + width)).reshape(count, 1 + width)
    groups = physical.get(entity, np.zeros(0, np.int64))
    return Block(kind, rows[:, 0], rows[:, 1:], np.broadcast_to(groups, (count, len(groups))))


def _binary_elements(section: Section, count: int) -> Iterator[Block]:
    """Yield so many elements of version 2: blocks with a head each, tags before the nodes."""
    found = 0
    while found < count:
        number, some, tags = section.integers(3).tolist()
        kind, width = _kind(section, number)
        if some < 1 or tags < 0:
            raise section.damaged(f"{some} elements with {tags} tags were found; expected some")
        columns = 1 + tags + width
        rows = section.integers(some * columns).reshape(some, columns)
        yield Block(kind, rows[:, 0], rows[:, 1 + tags :], np.abs(rows[:, 1 : 1 + min(tags, 1)]))
        found += some
    section.end()


def _element_lines(section: Section) -> Iterator[Block]:
    """Yield the elements of version 2, one a line, those of a kind together."""
    lines = parse_lines(section.path, np.frombuffer(section.remaining_text(), np.uint8))
    values, starts = whole_numbers(section.path, lines.values), lines.starts
    if (lines.counts < 3).any():
        raise section.damaged("an element with fewer than three numbers was found")
    kinds, tags = values[starts + 1], values[starts + 2]
    for number in dict.fromkeys(kinds.tolist()):
        kind, width = _kind(section, number)
        chosen = kinds == number
        if (tags[chosen] < 0).any() or (lines.counts[chosen] != 3 + tags[chosen] + width).any():
            raise section.damaged(f"a {kind} was found that has not {width} nodes behind its tags")
        first = (starts + 3 + tags)[chosen]
        nodes = values[first[:, None] + np.arange(width)]
        groups = np.where(tags[chosen] > 0, np.abs(values[starts[chosen] + 3]), 0)
        yield Block(kind, values[starts[chosen]], nodes, groups[:, None])


def _kind(section: Section, number: int) -> tuple[str, int]:
    """Return the name and the number of nodes of a kind of elements."""
    if number not in KINDS:
        raise UnsupportedFormatError(
            f"{section.path}: elements of Gmsh's kind {number} were found; expected triangles and quads;"
            " write these alone"
        )
    return KINDS[number]
