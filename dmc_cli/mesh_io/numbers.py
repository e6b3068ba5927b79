"""Read numbers out of text, many at a time."""

import warnings
from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import AnyArray, ByteArray, Float64Array, IntArray
from dmc_cli.errors import MeshFileError

SPACE, TAB, NEWLINE = 32, 9, 10


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
