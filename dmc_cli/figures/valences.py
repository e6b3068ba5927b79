"""Draw how many vertices have which valence, before and after each pass (2020: fig. 12; 2021: fig. 11)."""

from collections.abc import Mapping

import numpy as np

from dmc_cli.figures.style import COLORS, figure

LARGEST = 9
"""Valences from here on are drawn together."""


def draw_valences(folder: str, name: str, histograms: Mapping[str, Mapping[int, int]]) -> None:
    """Draw histograms beside each other, each the number of vertices by their valence."""
    with figure(folder, name) as axes:
        lowest = min((valence for each in histograms.values() for valence in each), default=2)
        valences = np.arange(min(lowest, 2), LARGEST + 1)
        width = 0.8 / max(len(histograms), 1)
        for number, (label, histogram) in enumerate(histograms.items()):
            total = sum(histogram.values()) or 1
            shares = [100.0 * histogram.get(int(valence), 0) / total for valence in valences[:-1]]
            shares.append(100.0 * sum(n for valence, n in histogram.items() if valence >= LARGEST) / total)
            places = valences + (number - (len(histograms) - 1) / 2) * width
            axes.bar(places, shares, width, label=label, color=COLORS[number % len(COLORS)])
        axes.set_xticks(valences, [*map(str, valences[:-1]), f"{LARGEST}+"])
        axes.set_xlabel("valence")
        axes.set_ylabel("vertices [%]")
        axes.grid(visible=False, axis="x")
        axes.legend(loc="upper right")
