"""Read numbers out of text, many at a time."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import orjson

from dmc_cli.array_types import AnyArray, ByteArray, Float64Array, IntArray
from dmc_cli.errors import MeshFileError

SPACE, TAB, NEWLINE, COMMA = 32, 9, 10, 44

FIELD_LINES = 1 << 16
"""Lines whose fields are taken apart at a time: each character takes tens of bytes meanwhile."""


@dataclass(frozen=True)
class NumberLines:
    """The numbers of the lines that have any.

    Attributes:
        values: All numbers in a row, float64.
        counts: Numbers of each line, int64.
    """

    values: Float64Array
    counts: IntArray

    @property
    def starts(self) -> IntArray:
        """Return the index in `values` of each line's first number."""
        return np.cumsum(self.counts) - self.counts


def parse_numbers(path: str, text: bytes) -> Float64Array:
    """Return the numbers of a text that has nothing else, float64.

    Raises:
        MeshFileError: Something is no number.
    """
    if not text or text.isspace():
        return np.zeros(0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # how NumPy before 2.3 tells the same
            return np.fromstring(text, sep=" ")
    except (ValueError, DeprecationWarning):
        word = next((w for w in text.split() if not _is_number(w)), b"")
        shown = word[:40].decode("ascii", "replace")
        raise MeshFileError(f"{path}: {shown!r} was found where a number was expected") from None


def parse_lines(path: str, text: ByteArray) -> NumberLines:
    """Return the numbers of a text line by line.

    Args:
        path: The file, for messages.
        text: Characters, uint8.

    Raises:
        MeshFileError: Something is no number.
    """
    begins = text > SPACE
    begins[1:] &= text[:-1] <= SPACE
    lines = np.searchsorted(np.flatnonzero(text == NEWLINE), np.flatnonzero(begins))
    counts = np.bincount(lines) if lines.size else np.zeros(0, dtype=np.int64)
    values = parse_numbers(path, text.tobytes())
    if values.size != counts.sum():
        raise MeshFileError(f"{path}: {counts.sum()} words were found, but {values.size} numbers in them")
    return NumberLines(values, counts[counts > 0])


def field_rows(path: str, text: bytes, widths: Sequence[int]) -> Float64Array:
    """Return the numbers of the first fields of each line: of fixed widths, or ended by commas.

    Args:
        path: The file, for messages.
        text: The lines; blank ones are passed over.
        widths: Characters of each field.

    Returns:
        Float64, (lines, fields).

    Raises:
        MeshFileError: A line has fewer numbers, or something is no number.
    """
    characters = np.frombuffer(text + b"\n", np.uint8)
    ends = np.flatnonzero(characters == NEWLINE)
    starts = np.concatenate([[0], ends[:-1] + 1])
    is_there = np.logical_or.reduceat(characters > SPACE, starts)
    starts, ends = starts[is_there], ends[is_there]
    rows = np.empty((len(starts), len(widths)))
    for first in range(0, len(starts), FIELD_LINES):
        some = slice(first, first + FIELD_LINES)
        rows[some] = _fields_of(path, characters, starts[some], ends[some], widths)
    return rows


def _fields_of(
    path: str, characters: ByteArray, starts: IntArray, ends: IntArray, widths: Sequence[int]
) -> Float64Array:
    """Return the numbers of some lines."""
    rows = np.empty((len(starts), len(widths)))
    here = characters[starts[0] : ends[-1] + 1]
    has_commas = np.logical_or.reduceat(here == COMMA, starts - starts[0])
    for line in np.flatnonzero(has_commas):
        words = characters[starts[line] : ends[line]].tobytes().split(b",")[: len(widths)]
        rows[line] = _row(path, b" ".join(words), len(widths))
    plain = np.flatnonzero(~has_commas)
    places = np.arange(sum(widths))
    where = starts[plain, None] + places
    is_inside = where < ends[plain, None]
    fields = np.where(is_inside, characters[np.where(is_inside, where, 0)], SPACE)
    spaced = np.insert(fields, np.cumsum(widths), COMMA, axis=1)
    numbers = _json_numbers(spaced.tobytes()[:-1])
    if numbers is None:
        spaced = np.where(spaced == COMMA, SPACE, spaced).astype(np.uint8)
        spaced[:, -1] = NEWLINE
        lines = parse_lines(path, spaced.ravel())
        if len(lines.counts) != len(plain) or (lines.counts != len(widths)).any():
            raise _too_few(path, len(widths))
        numbers = lines.values
    rows[plain] = numbers.reshape(-1, len(widths))
    return rows


def _json_numbers(text: bytes) -> Float64Array | None:
    """Return numbers with commas between, faster than NumPy does; None if one is not as JSON has it."""
    if any(letter in text for letter in (b"t", b"f", b"n", b'"', b"[", b"{")):
        return None
    try:
        return np.array(orjson.loads(b"[" + text + b"]"), np.float64)
    except orjson.JSONDecodeError:
        return None


def _row(path: str, text: bytes, count: int) -> Float64Array:
    """Return the numbers of a line with so many."""
    numbers = parse_numbers(path, text)
    if len(numbers) != count:
        raise _too_few(path, count)
    return numbers


def _too_few(path: str, count: int) -> MeshFileError:
    """Say that a line has too few numbers."""
    return MeshFileError(f"{path}: a line with fewer than {count} numbers was found; it is damaged")


def whole_numbers(path: str, values: AnyArray) -> AnyArray:
    """Return numbers of a file that have to be whole, as integers.

    Raises:
        MeshFileError: One is not.
    """
    if values.dtype.kind != "f":
        return values
    with np.errstate(invalid="ignore"):
        whole = values.astype(np.int64)
    odd = np.flatnonzero(whole != values)
    if odd.size:
        raise MeshFileError(f"{path}: {values.flat[odd[0]]:g} was found where a whole number was expected")
    return whole


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
