"""Find the data files that a header names: a list, or a pattern such as slice%03d.raw with a range."""

import re
from pathlib import Path, PureWindowsPath

from dmc_cli.errors import DamagedVolumeError, VolumeError
from dmc_cli.volume_io.layout import exists
from dmc_cli.volume_io.within import check_beside

MAX_FILES = 100_000
"""More files than any volume has slices."""


def named_file(header: Path, named: str, name: str, allow_outside: bool) -> Path:
    r"""Return the file that a header names, relative to the header's folder.

    A path that Windows wrote, such as `raw\scan.raw`, is read with slashes where no file has that name, and
    in other letters, small or capital, where one file has these.

    Raises:
        VolumeError: It is not there, or outside the folder and `allow_outside` is not set.
    """
    found = header.parent / named
    if "\\" in named and not exists(found):
        found = header.parent / named.replace("\\", "/")
    if not exists(found):
        found = _in_other_letters(found)
    if not exists(found):
        beside = PureWindowsPath(named).name
        todo = "put it beside the header"
        if beside and exists(header.parent / beside):
            todo = (
                f"a file {beside[:200]!r} is beside the header: if it is that one, name it so in the header"
            )
        raise VolumeError(f"{name}: its data file {named[:200]!r} is not there; {todo}")
    check_beside(header, found, named, name, allow_outside)
    return found


def _in_other_letters(path: Path) -> Path:
    """Return the only file of a folder whose name is that of a path but for small and capital letters.

    Of none, or of several, it is the path itself.
    """
    try:
        same = [file.name for file in path.parent.iterdir() if file.name.lower() == path.name.lower()]
    except (OSError, ValueError):
        return path
    return path.with_name(same[0]) if len(same) == 1 else path


def listed_files(header: Path, lines: list[str], name: str, allow_outside: bool) -> tuple[Path, ...]:
    """Return the files of a list, relative to the header's folder.

    Raises:
        VolumeError: A file is not there, or outside the folder and `allow_outside` is not set.
        DamagedVolumeError: The list is empty, or longer than any volume's.
    """
    if not lines:
        raise DamagedVolumeError(f"{name}: an empty list of data files found; expected one file a line")
    if len(lines) > MAX_FILES:
        raise DamagedVolumeError(f"{name}: {len(lines)} data files found; expected at most {MAX_FILES}")
    return tuple(named_file(header, line, name, allow_outside) for line in lines)


def pattern_files(
    header: Path, pattern: str, span: list[str], name: str, allow_outside: bool
) -> tuple[Path, ...]:
    """Return the files of a printf pattern for the numbers first, last (included) and step.

    Raises:
        VolumeError: A file is not there, or outside the folder and `allow_outside` is not set.
        DamagedVolumeError: Pattern or range make no sense.
    """
    wrong = (
        f"{name}: data file pattern {pattern[:60]!r} with range {' '.join(span)[:60]!r} found; "
        "expected one %d, first, last and step"
    )
    if not re.fullmatch(r"[^%]*%0?\d{0,2}d[^%]*", pattern):
        raise DamagedVolumeError(wrong)
    try:
        first, last, step = (int(token) for token in span)
    except ValueError as error:
        raise DamagedVolumeError(wrong) from error
    if step == 0 or not 0 <= (last - first) // step < MAX_FILES:
        raise DamagedVolumeError(wrong)
    numbers = range(first, last + (1 if step > 0 else -1), step)
    return listed_files(header, [pattern % number for number in numbers], name, allow_outside)
