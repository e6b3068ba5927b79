"""Tell whether a volume looks like a label map: whole numbers, few of them, in pieces, beside any others.

A few slices are looked at. Values of a scan vary from node to node; those of a field that was rounded to few
steps pass from one step to the next. In a label map most neighbours are equal, and where they are not, any
two labels may meet. Masks, of two values, are none: a surface at an isovalue is what is wanted of them.
"""

import re
from collections.abc import Iterator
from pathlib import PurePath

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.notices import Notice
from dmc_cli.volume.volume import Volume

SAMPLED = 8
"""Slices that are looked at."""

MOST_LABELS, MOST_HINTED = 64, 1024
"""Different values that a label map has at most; where its name says what it is."""

LEAST_EQUAL = 0.7
"""Share of neighbours with the same label, at least, of those that are not both background."""

LEAST_JUMPS = 0.05
"""Share of unequal neighbours whose values are not next to each other, at least."""

HINTS = re.compile(r"(?<![a-z])(d?seg|segmentation|labels?|labelmap|aseg|aparc|parcellation|wmparc)(?![a-z])")
"""Words in the names of files that say so."""


def told_as_labels(volume: Volume) -> tuple[Notice, ...]:
    """Return a warning where a volume that a surface at an isovalue is made of looks like a label map."""
    if not looks_like_labels(volume):
        return ()
    told = (
        "the volume looks like a label map: a surface at an isovalue joins all labels above it, and has"
        " stairs;"
        " --labels makes a smooth shell of each label"
    )
    return (Notice("W-LABEL-MAP", told),)


def looks_like_labels(volume: Volume) -> bool:
    """Return whether a volume looks like a label map, by its values and by what its file says."""
    if len({label.value for label in volume.labels}) > 1:
        return True
    if volume.values.dtype.kind not in "iu":
        return False
    hinted = HINTS.search(PurePath(volume.path).name.lower()) is not None
    return _is_in_pieces(volume.values, MOST_HINTED if hinted else MOST_LABELS, hinted=hinted)


def _is_in_pieces(values: AnyArray, most: int, *, hinted: bool) -> bool:
    """Return whether values are few, their neighbours mostly the same, and not always the next value."""
    found: set[int] = set()
    equal = unequal = jumps = 0
    for plane in _sampled(values):
        kinds, ranks = np.unique(plane, return_inverse=True)
        if len(kinds) > most:
            return False
        found.update(kinds.tolist())
        if len(found) > most:
            return False
        step = np.abs(np.diff(ranks.reshape(plane.shape), axis=1))
        both_empty = (plane[:, 1:] == 0) & (plane[:, :-1] == 0)
        equal += int(((step == 0) & ~both_empty).sum())
        unequal += int((step > 0).sum())
        jumps += int((step > 1).sum())
    if len(found) < 3 or equal < LEAST_EQUAL * (equal + unequal):
        return False
    return hinted or jumps >= LEAST_JUMPS * max(unequal, 1)


def _sampled(values: AnyArray) -> Iterator[AnyArray]:
    """Yield slices, the middle one first: it tells a scan at once."""
    count = len(values)
    chosen = np.unique(np.linspace(0, count - 1, min(SAMPLED, count)).astype(int)).tolist()
    yield values[count // 2]
    yield from (values[k] for k in chosen if k != count // 2)
