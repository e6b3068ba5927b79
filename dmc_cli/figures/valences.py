"""Draw how many vertices have which valence, before and after each pass (2020: fig. 12; 2021: fig. 11)."""

from collections.abc import Mapping

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.figures.style import COLORS, HATCHES, figure, legend_above

LARGEST = 9
"""Valences from here on are drawn together."""

SEEN = 0.05
"""Percent of the vertices that are seen as a bar; valences beyond the last such are left out."""


def draw_valences(folder: str, name: str, histograms: Mapping[str, Mapping[int, int]]) -> None:
    """Draw histograms beside each other, each the share of vertices by their valence."""
    shares = {label: _shares(histogram) for label, histogram in histograms.items()}
    seen = np.flatnonzero(np.max(list(shares.values()), axis=0) >= SEEN)
    valences = np.arange(seen.min(initial=3), seen.max(initial=5) + 1)
    with figure(folder, name) as axes:
        width = 0.84 / len(shares)
        for number, (label, own) in enumerate(shares.items()):
            axes.bar(
                valences + (number - (len(shares) - 1) / 2) * width,
                own[valences],
                width,
                label=label,
                color=COLORS[number % len(COLORS)],
                hatch=HATCHES[number % len(HATCHES)],
                edgecolor="white",
                linewidth=0.4,
            )
        axes.set_xticks(valences, [f"{each}+" if each == LARGEST else str(each) for each in valences])
        axes.set_xlabel("valence of a vertex")
        axes.set_ylabel("share of the vertices [%]")
        axes.grid(visible=False, axis="x")
        legend_above(axes)


def _shares(histogram: Mapping[int, int]) -> Float64Array:
    """Return percent of the vertices by valence, float64 (LARGEST + 1,), those beyond with the last."""
    counts = np.zeros(LARGEST + 1)
    for valence, count in histogram.items():
        counts[min(valence, LARGEST)] += count
    shares: Float64Array = 100.0 * counts / max(counts.sum(), 1)
    return shares
