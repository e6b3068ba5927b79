"""Write tables of numbers as lines of text, fast: an OBJ of 6 million quads takes seconds.

Floats are written by orjson, which knows the shortest decimal that reads back as the same float32;
its JSON is then rewritten with a few passes over the bytes. Indices of quads are written once for
each vertex that is near and then gathered, because every vertex stands in about four quads.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import orjson

from dmc_cli.mesh_io.mesh_file import Float32Array, Int32Array

CHUNK_ROWS = 1 << 15
"""Rows turned to text at once: some MB of text; larger gains nothing and takes more memory."""

GROUP_BITS = 8
"""Indices are written in groups of this many bits; groups that a chunk does without are left out: neighbours
have near numbers, but the vertices of special cells come last."""

_PADDING = 0
"""A byte that no text holds; it fills the tokens of shorter numbers and is deleted at the end."""


def chunks_of(array: np.ndarray[Any, Any]) -> Iterator[np.ndarray[Any, Any]]:
    """Yield the rows of an array in contiguous chunks, none for an empty array."""
    for start in range(0, len(array), CHUNK_ROWS):
        yield np.ascontiguousarray(array[start : start + CHUNK_ROWS])


def float_lines(rows: Float32Array, prefix: bytes = b"") -> bytes:
    """Write each row as a line: the prefix, then its numbers with a space between.

    Args:
        rows: Finite numbers, shape (n, columns), n at least 1, contiguous.
        prefix: What every line begins with.
    """
    json = orjson.dumps(rows, option=orjson.OPT_SERIALIZE_NUMPY)
    text = json[2:-2].replace(b"],[", b"\n" + prefix).replace(b",", b" ")
    return b"".join((prefix, text, b"\n"))


def quad_lines(quads: Int32Array, prefix: bytes, *, first: int = 0, repeat: int = 1) -> bytes:
    """Write each quad as a line: the prefix, then its four vertex indices, each after a space.

    Args:
        quads: Vertex indices from 0, shape (n, 4), n at least 1.
        prefix: What every line begins with.
        first: The index of the file's first vertex, 0 or 1.
        repeat: How often an index is written, joined by `//`: twice where a vertex's normal has
            the same index.
    """
    highest = int(quads.max())
    is_there = np.zeros((highest >> GROUP_BITS) + 1, bool)
    groups = quads >> GROUP_BITS
    is_there[groups] = True
    places = np.cumsum(is_there, dtype=np.int32) - 1
    indices = (np.flatnonzero(is_there)[:, None] << GROUP_BITS) + np.arange(1 << GROUP_BITS)
    tokens = _index_tokens(indices[indices <= highest] + first, repeat)
    width = tokens.dtype.itemsize
    lines = np.empty((len(quads), len(prefix) + 4 * width + 1), np.uint8)
    lines[:, : len(prefix)] = np.frombuffer(prefix, np.uint8)
    where = (places[groups] << GROUP_BITS) + (quads & ((1 << GROUP_BITS) - 1))
    lines[:, len(prefix) : -1] = tokens[where].view(np.uint8)
    lines[:, -1] = ord("\n")
    return lines.tobytes().replace(bytes([_PADDING]), b"")


def _index_tokens(indices: np.ndarray[Any, np.dtype[np.int64]], repeat: int) -> np.ndarray[Any, Any]:
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
        for turn in range(repeat):
            column = 1 + turn * (digits + 2)
            if turn:
                tokens[low:high, column - 2 : column] = ord("/")
            tokens[low:high, column : column + digits] = numbers
        low = high
    return tokens.view(f"V{tokens.shape[1]}")[:, 0]
