"""Order the slices of a folder by the numbers in their names, and tell what the names leave open.

One number that counts is what scanners and programs write: `rec0100.bmp`, `rec0101.bmp`. Names that are
unlike those of most others (a preview beside the slices) are left out; two stacks in one folder, two numbers
that count (slices and channels), a number twice and missing numbers are refused.
"""

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from dmc_cli.errors import AmbiguousVolumeError
from dmc_cli.notices import Notice
from dmc_cli.volume_io.left_out import shortened

CLEAR_SHARE = 0.75
"""A share of the names that are alike, beyond which the others are none of the slices."""

NO_PLACES = re.compile(
    r"(?<![a-z])(t|tp|time|times|timepoint|frame|frames|c|ch|channel|channels|wavelength|angle|theta|rot|"
    r"rotation|proj|projection|projections|view|tile|pos|position|echo|cycle|phase)[-_ .=]?$"
)
"""What stands before a number that may count something else than slices."""


@dataclass(frozen=True)
class Slices:
    """The slices of a folder.

    Attributes:
        files: Their files, in order.
        numbers: What their names count, one a file, or none where that is not one number.
        strays: Names of files of the same kind that are left out.
        notices: What the names leave open.
    """

    files: tuple[Path, ...]
    numbers: tuple[int, ...] = ()
    strays: tuple[str, ...] = ()
    notices: tuple[Notice, ...] = ()

    @property
    def step(self) -> int:
        """Return the distance of most neighbouring numbers, 1 where there are none."""
        steps = [after - before for before, after in zip(self.numbers, self.numbers[1:], strict=False)]
        return Counter(sorted(steps)).most_common(1)[0][0] if steps else 1


def ordered_slices(files: list[Path], name: str) -> Slices:
    """Return files of one kind in the order of the numbers in their names.

    Args:
        files: One at least.
        name: The input, for messages.

    Raises:
        AmbiguousVolumeError: They are two stacks, or two numbers count, or one number stands twice.
    """
    files = sorted(files, key=_natural_key)
    patterns = Counter(_pattern(file) for file in files)
    (pattern, count), *others = patterns.most_common()
    if others and others[0][1] > 1 and others[0][1] > (1 - CLEAR_SHARE) * len(files):
        raise AmbiguousVolumeError(
            f"{name}: slices of two kinds of names found: {count} like {pattern}, {others[0][1]} like "
            f"{others[0][0]}; expected one stack in a folder; put each into a folder of its own"
        )
    if count <= CLEAR_SHARE * len(files) or "#" not in pattern:
        return Slices(tuple(files), notices=_in_order_of_names(files) if len(files) > 1 else ())
    chosen = [file for file in files if _pattern(file) == pattern]
    strays = tuple(file.name for file in files if _pattern(file) != pattern)
    columns = list(zip(*(_numbers(file) for file in chosen), strict=True))
    counting = [column for column in columns if len({*column}) > 1]
    if len(counting) > 1:
        _check_product(counting, len(chosen), pattern, name)
        return Slices(tuple(chosen), strays=strays, notices=_in_order_of_names(chosen))
    numbers = counting[0] if counting else columns[0]
    notices = _no_place(pattern, columns.index(numbers)) if counting else ()
    twice = [number for number, times in Counter(numbers).items() if times > 1]
    if len(chosen) > 1 and twice:
        same = [file.name for file, number in zip(chosen, numbers, strict=True) if number == twice[0]]
        raise AmbiguousVolumeError(
            f"{name}: {' and '.join(same[:2])} have the same number; expected each slice once; leave one out"
        )
    ordered = sorted(zip(numbers, chosen, strict=True))  # the case of letters does not count
    return Slices(tuple(file for _, file in ordered), tuple(number for number, _ in ordered), strays, notices)


def _natural_key(file: Path) -> list[tuple[int, str]]:
    """Return what puts names in the order of their numbers, texts between them before any number."""
    parts = re.split(r"(\d+)", file.name)
    return [(int(part), "") if part.isdecimal() and part.isascii() else (-1, part) for part in parts]


def _pattern(file: Path) -> str:
    """Return a name with `#` for each number; case and the suffix do not count."""
    return re.sub(r"[0-9]+", "#", file.stem.lower())


def _numbers(file: Path) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"[0-9]+", file.stem)))


def _check_product(counting: list[tuple[int, ...]], count: int, pattern: str, name: str) -> None:
    """Refuse names in which two numbers or more count, each with each of the other."""
    sizes = [len({*column}) for column in counting]
    pairs = {*zip(*counting, strict=True)}
    product = 1
    for size in sizes:
        product *= size
    if len(pairs) == count == product:
        raise AmbiguousVolumeError(
            f"{name}: names like {pattern} found in which {' x '.join(map(str, sizes))} numbers count; "
            "expected one number that counts slices; put each channel, time or tile into a folder of its own"
        )


def _in_order_of_names(files: list[Path]) -> tuple[Notice, ...]:
    told = shortened([file.name for file in files], ", ")
    sentence = f"no single number in the names counts the slices; their order is that of the names: {told}"
    return (Notice("W-ORDER-ASSUMED", sentence),)


def _no_place(pattern: str, column: int) -> tuple[Notice, ...]:
    """Return a warning where the number that counts stands behind a word for something else than slices."""
    before = "#".join(pattern.split("#")[: column + 1])
    found = NO_PLACES.search(before.rpartition("#")[2])
    if found is None:
        return ()
    sentence = (
        f"the files are numbered by {found[1]!r} (names like {pattern}), which need not count slices; they "
        "are taken as slices along z"
    )
    return (Notice("W-AXES-MISSING", sentence),)


def missing_numbers(slices: Slices) -> list[int]:
    """Return the numbers that are missing between the first and the last slice, at most a thousand."""
    found: list[int] = []
    step = slices.step
    for before, after in zip(slices.numbers, slices.numbers[1:], strict=False):
        found += range(before + step, min(after, before + 1001 * step), step)
        if len(found) > 1000:
            break
    return found[:1000]
