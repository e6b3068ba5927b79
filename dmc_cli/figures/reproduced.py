"""Draw the papers' figures of the data set that was made again."""

from dmc_cli.figures.curves import draw_deviation, draw_quality
from dmc_cli.figures.valences import draw_valences
from dmc_cli.reproduction import Spreads


def draw_reproduction(spreads: Spreads, folder: str) -> None:
    """Draw the figures, each as SVG and PNG, named by year and number in the papers.

    figure_2020_10  equation 8 of the triangles of DMC, DMCS and MC
    figure_2020_11  deviation of the vertices before and after they are moved to the surface
    figure_2021_11  valences before simplification and after each pass; figure 12 of 2020 as well
    figure_2021_14  deviation of DC, DMC and DMCS
    figure_2021_15  equation 9 of the quads of DC, DMC and DMCS

    Raises:
        WriteError: A file cannot be written.
    """
    name = spreads.data.name
    triangles = {key: spreads.triangles[key] for key in ("DMC", "DMCS", "MC")}
    draw_quality(folder, f"figure_2020_10_{name}", "mean ratio of the triangles", triangles)
    draw_deviation(folder, f"figure_2020_11_{name}", "deviation / range of values", spreads.projections)
    draw_valences(folder, f"figure_2021_11_{name}", spreads.valences)
    deviations = {key: spreads.deviations[key] for key in ("DC", "DMC", "DMCS")}
    draw_deviation(folder, f"figure_2021_14_{name}", "deviation |f|", deviations)
    quads = {key: spreads.quads[key] for key in ("DC", "DMC", "DMCS")}
    draw_quality(folder, f"figure_2021_15_{name}", "shape quality of the quads", quads)
