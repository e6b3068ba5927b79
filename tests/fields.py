"""Small volumes with known answers, and the papers' fields written down from their formulas."""

from functools import cache
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from dmc_cli.volume.volume import Volume

Array = np.ndarray
PAPER_FIELDS = ("genus_two", "iwp", "neovius", "kummer", "steiner")


def volume_of(values: Array, **attributes: object) -> Volume:
    """A volume of the given values, [k, j, i], with the identity affine unless told otherwise."""
    settings = {"affine": np.eye(4), "space": "none", **attributes}
    return Volume(values=np.ascontiguousarray(values), **settings)


def one_cell(case: int, dtype: type = np.float32) -> Volume:
    """One cell, corner c at 1 where bit c of `case` is set, else at -1."""
    return volume_of(corner_values(case).reshape(2, 2, 2).astype(dtype))


def corner_values(case: int) -> Array:
    """The values of the eight corners of a case, shape (8,): 1 inside, -1 outside."""
    return np.array([1.0 if case >> c & 1 else -1.0 for c in range(8)])


def one_inside_node() -> Volume:
    """Five nodes an axis, all at -1 but the middle one at 1: the surface is a box of six quads."""
    values = np.full((5, 5, 5), -1, dtype=np.float32)
    values[2, 2, 2] = 1
    return volume_of(values)


def touching_nodes() -> Volume:
    """Two inside nodes on the diagonal of a face: an ambiguous face between two boxes."""
    values = np.full((5, 6, 6), -1, dtype=np.float32)
    values[2, 2, 2] = values[2, 3, 3] = 1
    return volume_of(values)


def plane(nodes: int = 6, height: float = 2.25) -> Volume:
    """Values falling along z, at 0 in the plane z = `height`."""
    k = np.arange(nodes, dtype=np.float32)
    return volume_of(np.broadcast_to((height - k)[:, None, None], (nodes, nodes, nodes)))


def sphere(nodes: int = 16, radius: float = 0.75) -> Volume:
    """Radius minus distance to the centre on [-1, 1]^3, float32."""
    x, y, z = coordinates(nodes)
    return volume_of((radius - np.sqrt(x * x + y * y + z * z)).astype(np.float32))


def white_noise(nodes: int, seed: int = 0) -> Volume:
    """Standard normal noise, float32, `nodes` along each axis."""
    noise = np.random.default_rng(seed).standard_normal((nodes, nodes, nodes))
    return volume_of(noise.astype(np.float32))


def smooth_noise(nodes: int, sigma: float = 2.0, seed: int = 0) -> Volume:
    """White noise smoothed by a Gaussian of `sigma` nodes, float32."""
    noise = np.random.default_rng(seed).standard_normal((nodes, nodes, nodes))
    return volume_of(gaussian_filter(noise, sigma).astype(np.float32))


def coordinates(nodes: int) -> tuple[Array, Array, Array]:
    """X, Y and Z over [-1, 1]^3, both ends included, float64, ready to broadcast to [k, j, i]."""
    along = np.linspace(-1.0, 1.0, nodes)
    return along[None, None, :], along[None, :, None], along[:, None, None]


@cache
def paper_field(name: str, nodes: int) -> Volume:
    """One of the papers' fields, evaluated in float64 and rounded to float32."""
    values = FORMULAS[name](*coordinates(nodes)).astype(np.float32)
    values.setflags(write=False)
    return volume_of(values)


def genus_two(x: Array, y: Array, z: Array) -> Array:
    """The papers' gen2."""
    x, y, z = 2 * x, 2 * y, 2 * z
    return 2 * y * (y * y - 3 * x * x) * (1 - z * z) + (x * x + y * y) ** 2 - (9 * z * z - 1) * (1 - z * z)


def iwp(x: Array, y: Array, z: Array) -> Array:
    """Schoen's I-WP, a little over five periods."""
    x, y, z = (np.cos(5.01 * np.pi * (t + 1)) for t in (x, y, z))
    return x * y + y * z + z * x - x * y * z


def neovius(x: Array, y: Array, z: Array) -> Array:
    """Neovius' surface, two periods."""
    x, y, z = (np.cos(2 * np.pi * (t + 1)) for t in (x, y, z))
    return 3 * (x + y + z) + 4 * x * y * z


def kummer(x: Array, y: Array, z: Array) -> Array:
    """Kummer's quartic with mu = 1.3."""
    x, y, z = 2 * x, 2 * y, 2 * z
    mu, root = 1.3, np.sqrt(2.0)
    factor = (3 * mu**2 - 1) / (3 - mu**2)
    p, q = 1 - z - root * x, 1 - z + root * x
    r, s = 1 + z + root * y, 1 + z - root * y
    return (x * x + y * y + z * z - mu**2) ** 2 - factor * p * q * r * s


def steiner(x: Array, y: Array, z: Array) -> Array:
    """Steiner's Roman surface, as the papers have it."""
    return (x * x + y * y + z * z - 1) ** 2 - ((z - 1) ** 2 - 2 * x * x) * ((z + 1) ** 2 - 2 * y * y)


FORMULAS = {
    "genus_two": genus_two,
    "iwp": iwp,
    "neovius": neovius,
    "kummer": kummer,
    "steiner": steiner,
}


NON_MANIFOLD_FOLDER = Path(__file__).parent / "data" / "nonmanifold"
NON_MANIFOLD_ISOVALUES = {
    "1-Edge": 900.0,
    "2-Edge": 900.0,
    "3-Edge": 900.0,
    "4-Edge": 900.0,
    "12-Merge-iso-241.525": 241.525,
    "Iterative-Fix": 900.0,
    "Non-Manifold-Vertex": 900.0,
}


def non_manifold_volume(name: str) -> Volume:
    """One of the seven volumes on which plain dual marching cubes is not manifold.

    Header: node counts x y z (int32), spacings (float32); then uint16 values, x fastest.
    """
    content = (NON_MANIFOLD_FOLDER / f"{name}.bin").read_bytes()
    nx, ny, nz = np.frombuffer(content, "<i4", 3)
    spacing = np.frombuffer(content, "<f4", 3, offset=12).astype(np.float64)
    values = np.frombuffer(content, "<u2", offset=24).reshape(nz, ny, nx)
    return volume_of(values, affine=np.diag([*spacing, 1.0]))
