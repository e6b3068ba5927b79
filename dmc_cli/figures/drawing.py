"""Draw all figures of a comparison into a folder."""

import numpy as np

from dmc_cli.app import Comparison, valences_of_passes
from dmc_cli.array_types import Float64Array
from dmc_cli.figures.curves import draw_deviation, draw_quality
from dmc_cli.figures.valences import draw_valences
from dmc_cli.measures import list_deviation, list_elements


def draw_figures(comparison: Comparison, folder: str) -> None:
    """Draw what the comparison has of the papers' figures, each as SVG and PNG.

    triangle_quality  equation 8 of all triangles, quads split by the MaxMin-angle criterion
    quad_quality      equation 9 of all quads, of methods that make them
    deviation         of the vertices from the isovalue, as a share of the range of values
    valences          of the dual marching cubes' mesh before and after each pass of simplification

    Raises:
        WriteError: A file cannot be written.
    """
    triangles: dict[str, Float64Array] = {}
    quads: dict[str, Float64Array] = {}
    deviations: dict[str, Float64Array] = {}
    ends = comparison.volume.value_range() or (0.0, 1.0)
    extent = (ends[1] - ends[0]) or 1.0
    for each in comparison.methods:
        elements = list_elements(each.mesh)
        triangles[each.method] = elements["mean_ratio"].reshape(-1)
        if np.isfinite(elements["shape"]).any():
            quads[each.method] = elements["shape"]
        deviations[each.method] = list_deviation(each.placement, comparison.volume) / extent
    draw_quality(folder, "triangle_quality", "mean ratio of the triangles", triangles)
    if quads:
        draw_quality(folder, "quad_quality", "shape quality of the quads", quads)
    draw_deviation(folder, "deviation", "deviation / range of values", deviations)
    histograms = valences_of_passes(comparison)
    if histograms:
        draw_valences(folder, "valences", histograms)
