"""Give all figures the same size, type and colours, and write each as SVG and PNG."""

import io
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from dmc_cli.errors import SettingsError
from dmc_cli.files import write_error, write_output

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#999999", "#000000")
"""Okabe and Ito's colours, which people tell apart who do not see all."""

DASHES: tuple[Any, ...] = (
    *("-", (0, (5, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (2, 1.2)), (0, (8, 1.5))),
    *((0, (4, 1, 1, 1, 1, 1)), (0, (1, 2))),
)
"""Kinds of lines, one with each colour, for those who print without."""

HATCHES = ("", "////", "....", "xxxx")
"""What bars are filled with, for the same."""

DRAWN = {"dmc": 0, "mc": 1, "tmc": 2, "dc": 3, "nets": 4, "macet": 5, "dmc+simplify": 7, "dmcs": 7}
"""Methods whose line is the same in every figure, with their places in the lists above."""

_STYLE: dict[Any, Any] = {
    **{"figure.figsize": (5.2, 3.4), "figure.dpi": 300, "savefig.bbox": "tight", "svg.hashsalt": "dmc"},
    **{"font.size": 9, "font.family": "serif", "mathtext.fontset": "dejavuserif", "svg.fonttype": "none"},
    **{"axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.6, "lines.linewidth": 1.3},
    **{"axes.grid": True, "grid.linewidth": 0.3, "grid.color": "#cccccc", "axes.axisbelow": True},
    **{"legend.frameon": False, "xtick.major.width": 0.6, "ytick.major.width": 0.6},
}

_DATELESS = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
"""What is left out of the files, so that the same figure has the same bytes."""


def prepare_figures(folder: str) -> None:
    """Make the folder of figures, before any work.

    Raises:
        SettingsError: Nothing can draw figures, or the folder is a file.
        WriteError: The folder cannot be made.
    """
    if find_spec("matplotlib") is None:
        raise SettingsError(
            'matplotlib is not installed, which draws the figures; pip install "dmc-cli[plots]", or leave out'
            " --figures"
        )
    if Path(folder).exists() and not Path(folder).is_dir():
        raise SettingsError(f"{folder} is a file; expected a folder for the figures; name another one")
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(folder, error) from error


def line_styles(names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return colour and dashes of each name: the same in every figure for what `DRAWN` has."""
    keys = list(names)
    own = {key: DRAWN[key.casefold()] for key in keys if key.casefold() in DRAWN}
    free = [number for number in range(len(COLORS)) if number not in own.values()]
    for key in keys:
        if key not in own:
            own[key] = free.pop(0) if free else len(own) % len(COLORS)
    return {key: {"color": COLORS[own[key]], "linestyle": DASHES[own[key]]} for key in keys}


def legend_above(axes: Any) -> None:
    """Put the legend above the axes, where it hides no curve."""
    place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.01), "borderaxespad": 0.0}
    axes.legend(ncols=3, handlelength=2.8, columnspacing=1.2, handletextpad=0.5, **place)


@contextmanager
def figure(folder: str, name: str) -> Iterator[Any]:
    """Open a figure and its axes; at the end write it as `name`.svg and `name`.png, replacing older ones."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    with mpl.rc_context(_STYLE):
        made, axes = pyplot.subplots()
        try:
            yield axes
            for kind, metadata in _DATELESS.items():
                content = io.BytesIO()
                made.savefig(content, format=kind, metadata=metadata)
                write_output(str(Path(folder) / f"{name}.{kind}"), [content.getvalue()], force=True)
        finally:
            pyplot.close(made)
