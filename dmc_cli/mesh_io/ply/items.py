"""Read the items of PLY files: a table of records, or records with a list each.

Consecutive records with lists of one length are read as a table. Where lengths differ, the end of a record
depends on its own list. Then the end is computed for a record at every byte of a piece, and the records that
are there are those reached from its first byte: pointer jumping finds them in a logarithmic number of steps.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np

from dmc_cli.array_types import AnyArray, IntArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.ply.header import LENGTH, Element

WINDOW = 64
"""Items that are looked at first for how many of one length follow each other; doubled while they do."""

MIXED_PLACES = 1 << 15
"""Places that items of several lengths are looked for in at a time: more take more doublings."""


@dataclass(frozen=True)
class Body:
    """What follows the header.

    Attributes:
        path: The file, for messages.
        data: The bytes; of text, its numbers as doubles.
        order: NumPy's letter for the byte order, none for text.
    """

    path: str
    data: memoryview
    order: str

    @property
    def unit(self) -> int:
        """Bytes between the places where an item may start."""
        return 1 if self.order else 8

    def at_every_place(self, start: int, dtype: np.dtype[Any]) -> AnyArray:
        """Return what stands at `start`, and a unit later, and so on, as values of a type."""
        count = max(0, (len(self.data) - start - dtype.itemsize) // self.unit + 1)
        return np.ndarray((count,), dtype, self.data, start if count else 0, (self.unit,))


@dataclass(frozen=True, kw_only=True)
class Items:
    """Items that follow each other.

    Attributes:
        end: Where they end.
        columns: The properties that are no lists, by their names, as the file has them.
        lengths: Entries of each list.
        entries: Entries of all lists in a row.
    """

    end: int
    columns: dict[str, AnyArray] = field(default_factory=dict)
    lengths: AnyArray = field(default_factory=lambda: np.zeros(0, np.int64))
    entries: AnyArray = field(default_factory=lambda: np.zeros(0, np.int64))


def read_items(body: Body, element: Element, position: int) -> Items:
    """Read an element that starts at a position.

    Raises:
        MeshFileError: The file ends early.
    """
    if not element.properties:
        return Items(end=position)
    if element.list_name:
        parts = list(_pieces(body, element, position))
        return Items(
            end=parts[-1].end,
            columns={name: np.concatenate([part.columns[name] for part in parts]) for name in element.types},
            lengths=np.concatenate([part.lengths for part in parts]),
            entries=np.concatenate([part.entries for part in parts]),
        )
    record = element.record(body.order)
    end = position + element.count * record.itemsize
    if end > len(body.data):
        _refuse_end(body, element)
    table = np.frombuffer(body.data, dtype=record, count=element.count, offset=position)
    return Items(end=end, columns={name: table[name] for name in element.types})


def _pieces(body: Body, element: Element, position: int) -> Iterator[Items]:
    """Yield all items with a list, none of them first, so that there is a piece."""
    yield _run(body, element, position, 0, 0)
    left, window = element.count, WINDOW
    while left:
        run = _longest_run(body, element, position, min(left, window))
        yield run
        count = len(run.lengths)
        if count < min(left, window):
            rest = _of_any_length(body, element, run.end, left - count)
            yield rest
            position, left, window = rest.end, left - count - len(rest.lengths), WINDOW
        else:
            position, left, window = run.end, left - count, 2 * window


def _longest_run(body: Body, element: Element, position: int, most: int) -> Items:
    """Return at least one item, and as many as follow with a list of the same length."""
    shortest, longer = element.record(body.order), element.record(body.order, 1)
    room = len(body.data) - position - shortest.itemsize
    if room < 0:
        _refuse_end(body, element)
    told = np.frombuffer(body.data, dtype=shortest, count=1, offset=position)[LENGTH][0]
    if not (0 <= told <= room // (longer.itemsize - shortest.itemsize) and told == int(told)):
        _refuse_end(body, element)
    record = element.record(body.order, int(told))
    count = min(most, (len(body.data) - position) // record.itemsize)
    lengths = np.frombuffer(body.data, dtype=record, count=count, offset=position)[LENGTH]
    same = lengths == told
    return _run(body, element, position, int(told), count if same.all() else int(np.argmin(same)))


def _run(body: Body, element: Element, position: int, length: int, count: int) -> Items:
    """Return items with lists of one length."""
    record = element.record(body.order, length)
    table = np.frombuffer(body.data, dtype=record, count=count, offset=position)
    return Items(
        end=position + count * record.itemsize,
        columns={name: table[name] for name in element.types},
        lengths=np.full(count, length),
        entries=table[element.list_name].ravel(),
    )


def _of_any_length(body: Body, element: Element, position: int, most: int) -> Items:
    """Return the next items, with lists of any lengths; none if the first one is damaged."""
    layout = element.record(body.order)
    offsets = {name: place[1] for name, place in (layout.fields or {}).items()}
    entry = element.record(body.order, 1)[element.list_name].base
    before, step = layout.itemsize // body.unit, entry.itemsize // body.unit  # sizes in places
    span = min(MIXED_PLACES, (len(body.data) - position) // body.unit)
    told = body.at_every_place(position + offsets[LENGTH], layout[LENGTH])[:span]
    fits = (told >= 0) & (told <= span) & (told == np.floor(told))
    ends = np.arange(len(told)) + before + np.where(fits, told, span).astype(np.int64) * step
    starts = _follow(np.minimum(ends, len(told)), most)
    starts = starts[ends[starts] <= span]
    lengths = told[starts].astype(np.int64)
    if not len(starts):
        return _run(body, element, position, 0, 0)
    entries = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    entries = np.repeat(starts, lengths) + entries * step
    columns = {}
    for name in element.types:
        is_behind = offsets[name] > offsets[LENGTH]
        column = body.at_every_place(position + offsets[name], layout[name])
        columns[name] = column[starts + is_behind * lengths * step]
    return Items(
        end=position + int(ends[starts[-1]]) * body.unit,
        columns=columns,
        lengths=lengths,
        entries=body.at_every_place(position + offsets[element.list_name], entry)[entries],
    )


def _follow(following: IntArray, most: int) -> IntArray:
    """Return place 0, the one that follows it, and so on, none at or beyond the end.

    Args:
        following: The place that follows each place, larger than it, at most as many as there are.
        most: How many places to return at most.
    """
    end = len(following)
    following = np.append(following, end)
    places = np.zeros(1, np.int64)
    while places[-1] < end and len(places) < most:
        places = np.concatenate([places, following.take(places)])  # as far again
        following = following.take(following)
    return places[places < end][:most]


def _refuse_end(body: Body, element: Element) -> NoReturn:
    raise MeshFileError(
        f"{body.path}: the file ends within the element {element.name}, of which {element.count} were"
        " expected; it is cut off"
    )
