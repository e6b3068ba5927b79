"""Draw elements and vertices sorted by quality and deviation (2020: figures 10, 11; 2021: figures 14, 15)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.figures.style import figure, legend_above, line_styles

POINTS = 600
"""Points of a curve: more are not seen."""

LEAST_DEVIATION = 1e-12
"""Share of the range of values below which a deviation is not drawn: the axis has no zero."""


def draw_quality(folder: str, name: str, label: str, values: Mapping[str, Float64Array]) -> None:
    """Draw the quality of the elements of each method, sorted, over the share of elements."""
    with figure(folder, name) as axes:
        _curves(axes, values)
        axes.set_xlabel("elements, sorted [%]")
        axes.set_ylabel(label)
        axes.set_xlim(0, 100)
        axes.set_ylim(0, 1)
        legend_above(axes)


def draw_deviation(folder: str, name: str, label: str, values: Mapping[str, Float64Array]) -> None:
    """Draw the deviation of the vertices of each method, sorted, on an axis of powers of ten."""
    with figure(folder, name) as axes:
        _curves(axes, {key: np.where(own >= LEAST_DEVIATION, own, 0.0) for key, own in values.items()})
        axes.set_xlabel("vertices, sorted [%]")
        axes.set_ylabel(label)
        axes.set_xlim(0, 100)
        axes.set_yscale("log")
        legend_above(axes)


def sorted_points(values: Float64Array) -> Float64Array:
    """Return sorted values, thinned out to what is seen: float64 (n, 2), share in percent and value."""
    ordered = np.sort(values[np.isfinite(values)])
    places = np.unique(np.linspace(0, max(len(ordered) - 1, 0), POINTS).round().astype(np.int64))
    places = places[: len(ordered)]
    return np.stack([100.0 * (places + 0.5) / max(len(ordered), 1), ordered[places]], axis=1)


def _curves(axes: Any, values: Mapping[str, Float64Array]) -> None:
    """Add a curve for each method; where a value is 0 there is none of a logarithm."""
    styles = line_styles(values)
    for method, own in values.items():
        share, value = sorted_points(own).T
        if len(share):
            axes.plot(share, value, label=method, **styles[method])
