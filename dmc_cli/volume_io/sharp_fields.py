"""Define synthetic fields with sharp edges, and their gradients: a turned box, and one with a hole.

Values are distances to the nearest face within the box, positive inside; across an edge the gradient jumps.
"""

from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array

Array = Any
"""A float64 array; numpy's own type loses itself in the formulas."""

HALF = (0.5, 0.4, 0.3)
"""Half the lengths of the box's sides."""

HOLE = 0.18
"""The radius of the hole through the box, along its shortest side."""

ANGLES = (0.3, 0.5, 0.7)
"""By which the box is turned about x, then y, then z, so that no face is parallel to an axis."""


def _turn() -> Float64Array:
    """Return the box's own axes as columns."""
    turned = np.eye(3)
    for axis, angle in enumerate(ANGLES):
        c, s = np.cos(angle), np.sin(angle)
        b, d = (axis + 1) % 3, (axis + 2) % 3
        about = np.eye(3)
        about[b, b], about[b, d], about[d, b], about[d, d] = c, -s, s, c
        turned = about @ turned
    return turned


TURN = _turn()


def _along(x: Array, y: Array, z: Array) -> list[Array]:
    """Return coordinates along the box's own axes."""
    return [TURN[0, k] * x + TURN[1, k] * y + TURN[2, k] * z for k in range(3)]


def box(x: Array, y: Array, z: Array) -> Array:
    """Return the values of the box."""
    a, b, c = (half - np.abs(t) for half, t in zip(HALF, _along(x, y, z), strict=True))
    return np.minimum(np.minimum(a, b), c)


def holed_box(x: Array, y: Array, z: Array) -> Array:
    """Return the values of the box less a cylinder."""
    a, b, _ = _along(x, y, z)
    return np.minimum(box(x, y, z), np.sqrt(a * a + b * b) - HOLE)


def box_gradient(points: Float64Array) -> Float64Array:
    """Return the gradient of the box's values at points, both (N, 3)."""
    own = points @ TURN
    nearest = np.argmin(np.array(HALF) - np.abs(own), axis=1)
    side = np.sign(np.take_along_axis(own, nearest[:, None], axis=1))
    return np.asarray(-side * TURN.T[nearest])


def holed_box_gradient(points: Float64Array) -> Float64Array:
    """Return the gradient of the values of the box with a hole at points, both (N, 3)."""
    own = points @ TURN
    distance = np.hypot(own[:, 0], own[:, 1])
    own[:, 2] = 0.0
    outwards = (own / np.where(distance > 0, distance, 1.0)[:, None]) @ TURN.T
    x, y, z = points.T
    is_hole = distance - HOLE < box(x, y, z)
    return np.where(is_hole[:, None], outwards, box_gradient(points))
