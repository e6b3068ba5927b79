"""Make synthetic fields, named `synth:FIELD:N`: N nodes an axis on [-1, 1]^3, both ends included.

Evaluated in double precision a few planes at a time and rounded to float32 (evaluating in float32
changes the surface's topology). The first five are the papers'; the formulas are in their coordinates.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import SettingsError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, allocate_values, check_shape
from dmc_cli.volume_io.layout import scale_affine
from dmc_cli.volume_io.sharp_fields import box, box_gradient, holed_box, holed_box_gradient

Array = Any
"""A float64 array; numpy's own type loses itself in the formulas."""

PREFIX = "synth:"

SLAB_NODES = 1 << 20
"""Nodes that are evaluated at a time: temporaries of 8 MiB each."""


def _genus_two(x: Array, y: Array, z: Array) -> Array:
    x, y, z = 2 * x, 2 * y, 2 * z
    return 2 * y * (y**2 - 3 * x**2) * (1 - z**2) + (x**2 + y**2) ** 2 - (9 * z**2 - 1) * (1 - z**2)


def _iwp(x: Array, y: Array, z: Array) -> Array:
    a, b, c = (np.cos(5.01 * np.pi * (t + 1)) for t in (x, y, z))
    return a * b + b * c + c * a - a * b * c


def _neovius(x: Array, y: Array, z: Array) -> Array:
    a, b, c = (np.cos(2 * np.pi * (t + 1)) for t in (x, y, z))
    return 3 * (a + b + c) + 4 * a * b * c


def _kummer(x: Array, y: Array, z: Array) -> Array:
    x, y, z = 2 * x, 2 * y, 2 * z
    mu = 1.3
    factor = (3 * mu**2 - 1) / (3 - mu**2)
    p, q = 1 - z - np.sqrt(2) * x, 1 - z + np.sqrt(2) * x
    r, s = 1 + z + np.sqrt(2) * y, 1 + z - np.sqrt(2) * y
    return (x**2 + y**2 + z**2 - mu**2) ** 2 - factor * p * q * r * s


def _steiner(x: Array, y: Array, z: Array) -> Array:
    outer = (x**2 + y**2 + z**2 - 1) ** 2
    return outer - ((z - 1) ** 2 - 2 * x**2) * ((z + 1) ** 2 - 2 * y**2)


def _sphere(x: Array, y: Array, z: Array) -> Array:
    return 0.75 - np.sqrt(x**2 + y**2 + z**2)


def _torus(x: Array, y: Array, z: Array) -> Array:
    return 0.25 - np.sqrt((np.sqrt(x**2 + y**2) - 0.6) ** 2 + z**2)


FIELDS: dict[str, Callable[[Array, Array, Array], Array]] = {
    "genus_two": _genus_two,
    "iwp": _iwp,
    "neovius": _neovius,
    "kummer": _kummer,
    "steiner": _steiner,
    "sphere": _sphere,
    "torus": _torus,
    "box": box,
    "csg": holed_box,
}
"""Fields that are formulas: broadcastable coordinates to values. `noise` is none."""

SHARP_GRADIENTS = {"box": box_gradient, "csg": holed_box_gradient}
"""Gradients of fields that are not smooth: points to gradients, both (N, 3)."""

COMPLEX_STEP = 1e-30
"""So small that what it leaves out of a derivative is no digit; nothing is subtracted that loses any."""

FIELD_NAMES = (*FIELDS, "noise")


def field_formula(field: str) -> Callable[[Float64Array], Float64Array] | None:
    """Return a field as a function of points, (N, 3) to (N,); None of the noise."""
    if field not in FIELDS:
        return None
    formula = FIELDS[field]
    return lambda points: np.asarray(formula(*points.T))


def field_gradient(field: str) -> Callable[[Float64Array], Float64Array] | None:
    """Return the exact gradient of a field, points to gradients, both (N, 3); None of the noise.

    The derivative of an analytic formula is the imaginary part of its value a small imaginary step away.
    """
    if field in SHARP_GRADIENTS:
        return SHARP_GRADIENTS[field]
    if field not in FIELDS:
        return None
    formula = FIELDS[field]

    def gradient(points: Float64Array) -> Float64Array:
        found = np.empty(points.shape)
        for axis in range(3):
            moved = points.astype(np.complex128)
            moved[:, axis] += 1j * COMPLEX_STEP
            found[:, axis] = formula(*moved.T).imag / COMPLEX_STEP
        return found

    return gradient


def parse_synthetic(name: str) -> tuple[str, int]:
    """Return the field and the number of nodes an axis of `synth:FIELD:N`.

    Raises:
        SettingsError: Another form, or an unknown field.
    """
    parts = name.split(":")
    if len(parts) != 3 or parts[1] not in FIELD_NAMES or not (parts[2].isascii() and parts[2].isdecimal()):
        raise SettingsError(
            f"{name}: found no synthetic field; expected synth:FIELD:N with N nodes an axis and FIELD one of "
            f"{', '.join(FIELD_NAMES)}, for example synth:iwp:128"
        )
    return parts[1], int(parts[2][:9])


def synthetic_volume(name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume `synth:FIELD:N`, float32, shape (N, N, N), spacing 2 / (N - 1), origin -1.

    The noise is standard normal from `settings.seed`, in the array's order, smoothed by a Gaussian of
    `settings.sigma` nodes (cut at four sigma, mirrored at the border).

    Raises:
        SettingsError: An unknown field, or a size that is no number.
        VolumeError: Fewer than two nodes.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    field, count = parse_synthetic(name)
    check_shape(name, (count, count, count))
    values = allocate_values(name, (count, count, count), np.float32)
    if field == "noise":
        _fill_noise(values, settings.seed, settings.sigma, progress)
    else:
        _fill_formula(values, FIELDS[field], progress)
    step = 2 / (count - 1)
    return Volume(
        values=values,
        affine=scale_affine((step, step, step), (-1.0, -1.0, -1.0)),
        space="none",
        path=name,
        format="synthetic",
        gradient=field_gradient(field),
        formula=field_formula(field),
    )


def _fill_formula(
    values: AnyArray,
    formula: Callable[[Array, Array, Array], Array],
    progress: Progress,
) -> None:
    count = len(values)
    line = np.linspace(-1, 1, count)
    planes = max(1, SLAB_NODES // count**2)
    for k in range(0, count, planes):
        z = line[k : k + planes, None, None]
        values[k : k + planes] = formula(line[None, None, :], line[None, :, None], z)
        progress.advance(min(1.0, (k + planes) / count))


def _fill_noise(values: AnyArray, seed: int, sigma: float, progress: Progress) -> None:
    """Draw plane by plane; with a sigma keep only the planes that the filter along z still needs."""
    count = len(values)
    draws = np.random.default_rng(seed)
    weights = gaussian_weights(sigma)
    radius = len(weights) // 2
    planes: dict[int, Array] = {}
    drawn = 0
    for k in range(count):
        while drawn < min(count, k + radius + 1):
            planes[drawn] = _smoothed_plane(draws.standard_normal((count, count)), weights)
            drawn += 1
        window = [mirrored(k + t, count) for t in range(-radius, radius + 1)]
        total = np.zeros((count, count))
        for weight, n in zip(weights, window, strict=True):
            total += weight * planes[n]
        values[k] = total
        planes.pop(k - radius, None)  # farther than the filter reaches, mirrored or not
        progress.advance((k + 1) / count)


def gaussian_weights(sigma: float) -> Array:
    """Return the weights of a Gaussian cut at four sigma, shape (2r + 1,), sum 1; one weight for sigma 0."""
    radius = int(4 * sigma + 0.5)
    offsets = np.arange(-radius, radius + 1)
    weights = np.exp(-0.5 * (offsets / sigma) ** 2) if radius else np.ones(1)
    return np.asarray(weights / weights.sum())


def mirrored(index: int, count: int) -> int:
    """Return the index inside 0..count-1 that a mirror at the border (d c b a | a b c d) puts there."""
    index %= 2 * count
    return index if index < count else 2 * count - 1 - index


def _smoothed_plane(plane: Array, weights: Array) -> Array:
    """Return the plane filtered along its two axes."""
    radius = len(weights) // 2
    if not radius:
        return plane
    window = [mirrored(n, len(plane)) for n in range(-radius, len(plane) + radius)]
    for _ in range(2):
        padded = plane[:, window]
        plane = sum(w * padded[:, t : t + len(plane)] for t, w in enumerate(weights)).T  # type: ignore[union-attr]
    return plane
