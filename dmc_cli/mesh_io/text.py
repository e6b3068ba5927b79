"""Write tables of numbers as lines of text, fast: an OBJ of 6 million quads takes seconds.

Floats are written by orjson, which knows the shortest decimal that reads back as the same float32;
its JSON is then rewritten with a few passes over the bytes. Indices of faces are written once for
each vertex that is near and then gathered, because every vertex stands in about four quads.
"""

from collections.abc import Iterator, Sequence
from itertools import chain, zip_longest

import numpy as np
import orjson

from dmc_cli.array_types import AnyArray, ByteArray, Float32Array, Int32Array, IntArray

CHUNK_ROWS = 1 << 15
"""Rows turned to text at once: some MB of text; larger gains nothing and takes more memory."""

GROUP_BITS = 8
"""Indices are written in groups of this many bits; groups that a chunk does without are left out: neighbours
have near numbers, but the vertices of special cells come last."""

_PADDING = 0
"""A byte that no text holds; it fills the tokens of shorter numbers and is deleted at the end."""


def chunks_of(array: AnyArray, dtype: type[np.generic] | None = None) -> Iterator[AnyArray]:
    """Yield the rows of an array in contiguous chunks of this type or its own, none for an empty array."""
    for start, stop in spans(len(array)):
        yield np.ascontiguousarray(array[start:stop], dtype=dtype)


def spans(count: int) -> Iterator[tuple[int, int]]:
    """Yield where each chunk of so many rows begins and ends."""
    for start in range(0, count, CHUNK_ROWS):
        yield start, min(start + CHUNK_ROWS, count)


def float_lines(rows: Float32Array, prefix: bytes = b"") -> bytes:
    """Write each row as a line: the prefix, then its numbers with a space between.

    Args:
        rows: Finite numbers, shape (n, columns), n at least 1, contiguous.
        prefix: What every line begins with.
    """
    json = orjson.dumps(rows, option=orjson.OPT_SERIALIZE_NUMPY)
    text = json[2:-2].replace(b"],[", b"\n" + prefix).replace(b",", b" ")
    return b"".join((prefix, text, b"\n"))


def number_lines(rows: AnyArray) -> bytes:
    """Write each row as a line, of numbers of any type; no number and infinity are nan, inf and -inf.

    Args:
        rows: Shape (n,) or (n, columns), n at least 1, contiguous.
    """
    rows = rows.reshape(len(rows), -1)
    lines = float_lines(rows)
    is_odd = ~np.isfinite(rows)
    if not is_odd.any():
        return lines
    odd = rows[is_odd]  # null in JSON
    words = np.where(np.isnan(odd), b"nan", np.where(odd > 0, b"inf", b"-inf")).tolist()
    return b"".join(chain.from_iterable(zip_longest(lines.split(b"null"), words, fillvalue=b"")))


def framed_lines(rows: AnyArray, words: Sequence[bytes]) -> bytes:
    """Write each row as its finite numbers between words: the first word, a number, the second word, ...

    Args:
        rows: Shape (n, columns), n at least 1, contiguous.
        words: One more than a row has numbers; the last one ends the row.
    """
    digits, lengths = _number_texts(rows)
    gaps = [len(word) for word in (*words[1:-1], words[-1] + words[0])]
    ends = len(words[0]) + np.cumsum(lengths + np.tile(gaps, len(rows)))
    text = np.empty(ends[-1], np.uint8)
    is_digit = np.ones(len(text), bool)
    text[: len(words[0])] = np.frombuffer(words[0], np.uint8)
    is_digit[: len(words[0])] = False
    for column, word in enumerate((*words[1:-1], words[-1] + words[0])):
        places = ends[column :: rows.shape[1], None] + np.arange(-len(word), 0)
        text[places] = np.frombuffer(word, np.uint8)
        is_digit[places] = False
    text[is_digit] = digits
    return text[: len(text) - len(words[0])].tobytes()


def right_aligned(rows: AnyArray, width: int) -> ByteArray:
    """Write finite numbers at the right of fields of one width; uint8, shape (n, columns, width).

    Args:
        rows: Shape (n, columns), n at least 1, contiguous; no number takes more than the width.
        width: Characters of a field.
    """
    digits, lengths = _number_texts(rows)
    fields = np.full((len(lengths), width), ord(" "), np.uint8)
    fields[np.arange(width) >= width - lengths[:, None]] = digits
    return fields.reshape(*rows.shape, width)


def _number_texts(rows: AnyArray) -> tuple[ByteArray, IntArray]:
    """Return the characters of all numbers without anything between, and how many each number has."""
    json = orjson.dumps(rows, option=orjson.OPT_SERIALIZE_NUMPY)
    text = np.frombuffer(json[2:-2].replace(b"],[", b",") + b",", np.uint8)
    is_end = text == ord(",")
    return text[~is_end], np.diff(np.flatnonzero(is_end), prepend=-1) - 1


def join_lines(texts: Sequence[bytes]) -> bytes:
    """Join texts of as many lines line by line, with a space between."""
    if len(texts) == 1:
        return texts[0]
    characters = [np.frombuffer(text, np.uint8) for text in texts]
    ends = np.stack([np.flatnonzero(text == ord("\n")) + 1 for text in characters], axis=1)
    lengths = np.diff(ends, axis=0, prepend=0)
    joined_ends = np.cumsum(lengths).reshape(lengths.shape)
    joined = np.empty(joined_ends[-1, -1], np.uint8)
    for i, text in enumerate(characters):
        moved = np.repeat(joined_ends[:, i] - ends[:, i], lengths[:, i])
        joined[np.arange(len(text)) + moved] = text
    joined[joined_ends[:, :-1] - 1] = ord(" ")
    return joined.tobytes()


def face_lines(faces: Int32Array, prefix: bytes | None = None, *, first: int = 0, repeat: int = 1) -> bytes:
    """Write each face as a line: a word, then its three or four vertex indices, each after a space.

    Args:
        faces: Vertex indices from 0, shape (n, 4), n at least 1; a triangle's fourth is -1.
        prefix: What every line begins with; without it, the number of the face's corners.
        first: The index of the file's first vertex, 0 or 1.
        repeat: How often an index is written, joined by `//`: twice where a vertex's normal has
            the same index.
    """
    highest = int(faces.max())
    is_there = np.zeros((highest >> GROUP_BITS) + 1, bool)
    groups = faces >> GROUP_BITS  # that of no corner is the last one, which is there
    is_there[groups] = True
    places = np.cumsum(is_there, dtype=np.int32) - 1
    indices = (np.flatnonzero(is_there)[:, None] << GROUP_BITS) + np.arange(1 << GROUP_BITS)
    tokens = _index_tokens(indices[indices <= highest] + first, repeat)
    width = tokens.dtype.itemsize
    word = b"4" if prefix is None else prefix
    lines = np.empty((len(faces), len(word) + 4 * width + 1), np.uint8)
    lines[:, : len(word)] = np.frombuffer(word, np.uint8)
    where = (places[groups] << GROUP_BITS) + (faces & ((1 << GROUP_BITS) - 1))
    is_triangle = faces[:, 3] < 0
    where[is_triangle, 3] = 0
    lines[:, len(word) : -1] = tokens[where].view(np.uint8)
    lines[is_triangle, -1 - width : -1] = _PADDING
    if prefix is None:
        lines[is_triangle, 0] = ord("3")
    lines[:, -1] = ord("\n")
    return lines.tobytes().replace(bytes([_PADDING]), b"")


def _index_tokens(indices: IntArray, repeat: int) -> AnyArray:
    """Write each of ascending indices as ` 17` or ` 17//17`, padded to one width."""
    longest = len(str(indices[-1]))
    tokens = np.full((len(indices), 1 + repeat * longest + 2 * (repeat - 1)), _PADDING, np.uint8)
    tokens[:, 0] = ord(" ")
    low = 0
    while low < len(indices):
        digits = len(str(indices[low]))
        high = int(np.searchsorted(indices, 10**digits))
        json = orjson.dumps(indices[low:high], option=orjson.OPT_SERIALIZE_NUMPY)
        numbers = np.frombuffer(json, np.uint8, offset=1).reshape(high - low, digits + 1)[:, :digits]
        for copy in range(repeat):
            column = 1 + copy * (digits + 2)
            if copy:
                tokens[low:high, column - 2 : column] = ord("/")
            tokens[low:high, column : column + digits] = numbers
        low = high
    return tokens.view(f"V{tokens.shape[1]}")[:, 0]
