"""Settle lengths that a file leaves in doubt: as they are taken, and told, or as `--spacing` has them."""

from collections.abc import Mapping

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.layout import without_effect

Doubts = tuple[Notice, ...]
"""What is told of lengths that a file tells in an unknown unit or in none, where nobody knows better."""


def settled_affine(
    affine: Float64Array, doubts: Doubts, settings: ReadSettings, what: str = "the file"
) -> tuple[Float64Array, tuple[Notice, ...]]:
    """Return the affine of a file that places its grid wholly, shape (4, 4), and what is told of it.

    Args:
        affine: Node index to millimetres, as the file has it.
        doubts: Those of its lengths.
        settings: Their spacing counts where there are doubts, and has no effect elsewhere.
        what: What tells the lengths, as messages begin.
    """
    unused = without_effect("origin", settings, what)
    if not doubts:
        return affine, without_effect("spacing", settings, what) + unused
    if settings.spacing is None:
        return affine, doubts + unused
    return respaced(affine, doubts, settings), unused


def missing_spacing(taken: Mapping[str, float], what: str) -> Doubts:
    """Return what is told where the distances of the nodes are missing along some axes.

    Args:
        taken: The length in millimetres that is taken along each of them, by the axis.
        what: What tells the others, as messages begin.
    """
    if not taken:
        return ()
    along = "" if len(taken) == 3 else f" along {' and '.join(taken)}"
    lengths = [f"{length:g}" for length in dict.fromkeys(taken.values())]
    told = f"{' and '.join(lengths)} mm {'is' if len(lengths) == 1 else 'are'} taken"
    return (Notice("W-SPACING-MISSING", f"{what} tells no spacing{along}; {told}; --spacing gives it"),)


def unsettled_lengths(told: Doubts, settings: ReadSettings) -> Doubts:
    """Return what is told of lengths that are not used, without what the settings tell themselves."""
    return tuple(
        notice
        for notice in told
        if (settings.origin if notice.code == "W-POSITION-MISSING" else settings.spacing) is None
    )


def respaced(affine: Float64Array, doubts: Doubts, settings: ReadSettings) -> Float64Array:
    """Return the affine with the settings' spacing where lengths are in doubt, else as it is.

    The world's origin stays beside the same node, for it was told in the same unit.
    """
    if not doubts or settings.spacing is None:
        return affine
    linear = affine[:3, :3]
    with np.errstate(all="ignore"):
        columns = linear * (np.array(settings.spacing) / np.linalg.norm(linear, axis=0))
        try:
            first = columns @ np.linalg.solve(linear, affine[:3, 3])
        except np.linalg.LinAlgError:
            return affine  # which is refused where every affine is checked
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = columns, first
    return found
