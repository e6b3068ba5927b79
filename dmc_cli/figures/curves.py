"""Draw elements and vertices sorted by quality and deviation (2020: figures 10, 11; 2021: figures 14, 15)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.figures.style import COLORS, DASHES, figure

POINTS = 600
"""Points of a curve: more are not seen."""

LEAST_DEVIATION = 1e-12
"""Share of the range of values below which a deviation is drawn there: the axis has no zero."""


def draw_quality(folder: str, name: str, label: str, values: Mapping[str, Float64Array]) -> None:
    """Draw the quality of the elements of each method, sorted, over the share of elements."""
    with figure(folder, name) as axes:
        for number, (method, quality) in enumerate(values.items()):
            _curve(axes, number, method, quality)
        axes.set_xlabel("elements, sorted [%]")
        axes.set_ylabel(label)
        axes.set_xlim(0, 100)
        axes.set_ylim(0, 1)
        axes.legend(loc="lower right")


def draw_deviation(folder: str, name: str, values: Mapping[str, Float64Array]) -> None:
    """Draw the deviation of the vertices of each method as a share of the range of values, sorted."""
    with figure(folder, name) as axes:
        for number, (method, deviation) in enumerate(values.items()):
            _curve(axes, number, method, np.maximum(deviation, LEAST_DEVIATION))
        axes.set_xlabel("vertices, sorted [%]")
        axes.set_ylabel("deviation / range of values")
        axes.set_xlim(0, 100)
        axes.set_yscale("log")
        axes.legend(loc="best")


def _curve(axes: Any, number: int, label: str, values: Float64Array) -> None:
    """Add the sorted values of a method, thinned out to what is seen."""
    ordered = np.sort(values[np.isfinite(values)])
    if not len(ordered):
        return
    places = np.unique(np.linspace(0, len(ordered) - 1, POINTS).round().astype(np.int64))
    share = 100.0 * (places + 0.5) / len(ordered)
    style = {"color": COLORS[number % len(COLORS)], "linestyle": DASHES[number % len(DASHES)]}
    axes.plot(share, ordered[places], label=label, **style)
