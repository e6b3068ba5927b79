"""Check what settings of several kinds may be beyond their types: paths, formats, devices, threads, noise."""

import math
import re
from collections.abc import Iterable, Mapping

from dmc_cli.errors import SettingsError
from dmc_cli.settings.types import is_whole

MOST_THREADS = 4096
"""CPU threads that may be asked for: more than machines have cores."""

WIDEST_SMOOTHING = 10_000
"""Nodes of a Gaussian, at most: its filter has eight weights a node."""


def check_path(name: str, path: str | None) -> None:
    """Raise SettingsError for a path that no system can have."""
    if path is not None and "\0" in path:
        raise SettingsError(f"{name} is {path!r}; expected a path without the character NUL")


def check_outputs(paths: Mapping[str, str | None], stream: str) -> None:
    """Raise SettingsError unless outputs, by what they hold, have names, `stream` no more than once."""
    for name, path in paths.items():
        check_path(name, path)
        if path == "":
            raise SettingsError(f"the name of the {name} is empty; expected a file's name; give one")
    streamed = [name for name, path in paths.items() if path == stream]
    if len(streamed) > 1:
        raise SettingsError(
            f"the {streamed[0]} and the {streamed[1]} are both sent to standard output; give one of them"
            " a file's name"
        )


def check_reference(volume: str | None, isovalue: float | None) -> None:
    """Raise SettingsError unless a level is a number, and has a volume."""
    if isovalue is not None and not math.isfinite(isovalue):
        raise SettingsError(f"isovalue is {isovalue}; expected a finite number")
    if isovalue is not None and volume is None:
        raise SettingsError(
            f"isovalue {isovalue:g} was given, but no volume; name the volume that the mesh was made from"
            " with --volume"
        )


def check_format(name: str, given: str | None, known: Iterable[str]) -> None:
    """Raise SettingsError for a format that is none of those that are known."""
    if given is not None and given not in known:
        raise SettingsError(f"{name} is {given!r:.80}; expected one of {', '.join(known)}")


def check_wall(wall: float | None) -> None:
    """Raise SettingsError unless walls can be so thick."""
    if wall is not None and not 0 < wall < math.inf:
        raise SettingsError(f"wall is {wall}; expected a positive length")


def check_told_wall(wall: float | None, *, is_told: bool) -> None:
    """Raise SettingsError if walls are to be measured that nothing tells of."""
    check_wall(wall)
    if wall is not None and not is_told:
        raise SettingsError(
            f"wall is {wall:g}, but nothing tells how thick walls are; name a report with --report, or"
            " require something of them"
        )


def check_marked(marked: str | None, require: tuple[str, ...]) -> None:
    """Raise SettingsError if faces are to be marked, but nothing is required of them."""
    if marked is not None and not require:
        raise SettingsError(
            f"marked is {marked!r:.80}, but nothing is required that a face could be to blame for;"
            " say what with --require"
        )


def check_run(device: str, threads: int | None) -> None:
    """Raise SettingsError unless a device and a number of CPU threads can be meant."""
    if not isinstance(device, str) or not re.fullmatch(r"auto|cpu|cuda(:[0-9]+)?", device):
        raise SettingsError(f"device is {device!r}; expected auto, cpu, cuda or cuda:N")
    check_threads(threads)


def check_threads(threads: int | None) -> None:
    """Raise SettingsError unless so many CPU threads can be meant."""
    if threads is not None and (not is_whole(threads) or threads < 1):
        raise SettingsError(f"threads is {threads!r}; expected 1 or more, a whole number")
    if threads is not None and threads > MOST_THREADS:
        raise SettingsError(
            f"threads is beyond {MOST_THREADS}; expected as many as there are cores, or fewer"
        )


def check_noise(seed: int, sigma: float) -> None:
    """Raise SettingsError unless synthetic noise can be made so."""
    if seed < 0:
        raise SettingsError(f"seed is {seed}; expected a whole number, 0 or more")
    if not 0 <= sigma <= WIDEST_SMOOTHING:
        raise SettingsError(f"sigma is {sigma}; expected a number of nodes, 0 to {WIDEST_SMOOTHING}")
