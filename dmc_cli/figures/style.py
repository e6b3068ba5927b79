"""Give all figures the same size, type and colours, and write each as SVG and PNG."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from dmc_cli.errors import SettingsError
from dmc_cli.files import write_output

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#999999", "#000000")
"""Okabe and Ito's colours, which people tell apart who do not see all."""

DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)), "--", ":", "-.", "-")
"""Kinds of lines, one with each colour, for those who print without."""

_STYLE: dict[Any, Any] = {
    **{"figure.figsize": (5.2, 3.4), "figure.dpi": 200, "savefig.bbox": "tight", "svg.hashsalt": "dmc"},
    **{"font.size": 9, "font.family": "serif", "mathtext.fontset": "dejavuserif", "svg.fonttype": "none"},
    **{"axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.6, "lines.linewidth": 1.3},
    **{"axes.grid": True, "grid.linewidth": 0.3, "grid.color": "#cccccc", "axes.axisbelow": True},
    **{"legend.frameon": False, "xtick.major.width": 0.6, "ytick.major.width": 0.6},
}

_DATELESS = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
"""What is left out of the files, so that the same figure has the same bytes."""


def check_figures(folder: str) -> None:
    """Raise SettingsError, before any work, if no figure can be drawn into a folder."""
    if find_spec("matplotlib") is None:
        raise SettingsError(
            'matplotlib is not installed, which draws the figures; pip install "dmc-cli[plots]", or leave out'
            " --figures"
        )
    if Path(folder).exists() and not Path(folder).is_dir():
        raise SettingsError(f"{folder} is a file; expected a folder for the figures; name another one")


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
            Path(folder).mkdir(parents=True, exist_ok=True)
            for kind, metadata in _DATELESS.items():
                content = io.BytesIO()
                made.savefig(content, format=kind, metadata=metadata)
                write_output(str(Path(folder) / f"{name}.{kind}"), [content.getvalue()], force=True)
        finally:
            pyplot.close(made)
