"""Judge times at each place: whether the n-th of one place belongs to the n-th of another.

Where a file is missing at one place, later ones would move up, and volumes would be mixed.
"""

import re

import numpy as np

from dmc_cli.array_types import Float64Array

SINCE_TRIGGER = ("trigger time", "trigger delay")
"""Times that begin anew at each place."""


def are_regular(values: list[list[str]], name: str) -> bool:
    """Return whether images at each place follow each other as at all others.

    Either one repetition of all places is over before the next begins, or each place has all of its own in
    turn, after the same parts of their time.

    Args:
        values: Times in order at each place, as many at each.
        name: What they are, of `labels.TIMES`.
    """
    found = [[_seconds(value, name) for value in place] for place in values]
    if any(time is None for place in found for time in place):
        return False
    times = np.array(found, np.float64)
    if (times[:, :-1].max(axis=0) < times[:, 1:].min(axis=0)).all():
        return True
    return (name in SINCE_TRIGGER or _in_turn(times)) and _alike(times)


def _in_turn(times: Float64Array) -> bool:
    """Return whether each place is over before the next begins."""
    ordered = times[times[:, 0].argsort()]
    return bool((ordered[:-1, -1] < ordered[1:, 0]).all())


def _alike(times: Float64Array) -> bool:
    """Return whether times are at the same parts of those of their place."""
    since = times - times[:, :1]
    parts = since / since[:, -1:]
    return bool(np.ptp(parts, axis=0).max() < 0.5 / (times.shape[1] - 1))


def _seconds(value: str, name: str) -> float | None:
    """Return a time of day in seconds, any other number as it is; None for what is none."""
    clock = re.fullmatch(r"(\d{8})?(\d{2})(\d{2})(\d{2}(?:\.\d+)?)", value)
    if name.endswith("time") and name not in SINCE_TRIGGER and clock:
        day, hours, minutes, seconds = (float(part or 0) for part in clock.groups())
        return ((day * 24 + hours) * 60 + minutes) * 60 + seconds
    try:
        return float(value)
    except ValueError:
        return None
