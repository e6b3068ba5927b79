"""Draw a histogram in the terminal: a line for each range of values, isovalues marked beside it."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

LINES = 24
"""Ranges of values that are drawn."""

_BAR = 32
"""Characters of the longest bar."""


def binned(
    values: Sequence[float], counts: Sequence[int], ends: tuple[float, float] | None
) -> dict[str, Any] | None:
    """Return edges of ranges of one width and how many nodes have a value in each, as JSON holds them.

    Args:
        values: Values, ascending.
        counts: How many nodes have each.
        ends: The least and the greatest value; None where there is none.
    """
    if ends is None or not ends[0] < ends[1]:
        return None
    low, high = ends
    shares = [n / LINES for n in range(LINES + 1)]
    edges = [low * (1 - share) + high * share for share in shares]
    found, at = [0] * LINES, 0
    for value, count in zip(values, counts, strict=True):
        while at < LINES - 1 and value >= edges[at + 1]:
            at += 1
        found[at] += int(count)
    return {"edges": edges, "counts": found}


def histogram_lines(histogram: dict[str, Any], isovalues: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield the lines of a histogram; bars grow with the cube root of the count.

    Args:
        histogram: As `binned` returns it.
        isovalues: Suggestions, `choice` and `isovalue` each; one stands beside the range that it lies in.
    """
    edges, counts = histogram["edges"], histogram["counts"]
    tallest = max(counts)
    yield "histogram nodes from each value on; bars grow with the cube root"
    for n, count in enumerate(counts):
        bar = "█" * math.ceil(_BAR * (count / tallest) ** (1 / 3))
        is_last = n == len(counts) - 1
        marks = [
            f"{one['choice']} {one['isovalue']:.6g}"
            for one in isovalues
            if edges[n] <= one["isovalue"] < edges[n + 1] or (is_last and one["isovalue"] == edges[-1])
        ]
        text = f"{edges[n]:>10.5g} {bar:<{_BAR}} {count:>11}"
        yield f"{text}  ◄ {', '.join(marks)}" if marks else text
