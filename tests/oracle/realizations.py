"""Corner values for every case and every set of face decisions that a trilinear cell can have."""

from functools import cache

import numpy as np

from tests.oracle.cube import face_corners, is_ambiguous
from tests.oracle.faces import joins_inside

DRAWS = 3000
"""Random magnitudes tried for the case with six ambiguous faces; the others need fewer."""


@cache
def realizable_cells() -> list[tuple[int, tuple[bool, ...], np.ndarray]]:
    """Case, decisions on the six faces and corner values (8,), for all that random values reach.

    Opposite faces decide with the same four products, so not every combination exists.
    """
    rng = np.random.default_rng(0)
    found = []
    for case in range(256):
        ambiguous = [face for face in range(6) if is_ambiguous(case, face)]
        signs = np.array([1.0 if case >> c & 1 else -1.0 for c in range(8)])
        seen = {}
        for _ in range({0: 1, 1: 40, 2: 200, 3: 400}.get(len(ambiguous), DRAWS)):
            values = signs * np.exp(rng.normal(0.0, 1.5, 8))
            joined = tuple(
                face in ambiguous and joins_inside(*values[list(face_corners(face))]) for face in range(6)
            )
            seen.setdefault(joined, values)
        found += [(case, joined, values) for joined, values in sorted(seen.items())]
    return found
