import math
import tracemalloc

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from dmc_cli.errors import MemoryBudgetError, SettingsError, VolumeError
from dmc_cli.volume_io import synthetic
from tests.volume_io.reading import read


def grid(count):
    line = np.linspace(-1, 1, count)
    return np.meshgrid(line, line, line, indexing="ij")[::-1]


def test_nodes_lie_on_the_cube_with_both_ends():
    volume = read("synth:sphere:5")
    assert volume.shape == (5, 5, 5)
    np.testing.assert_array_equal(volume.affine @ [0, 2, 4, 1], [-1, 0, 1, 1])
    assert (volume.space, volume.values.dtype) == ("none", np.float32)


@pytest.mark.parametrize(
    ("field", "at", "expected"),
    [
        ("sphere", (1, 0, 0), -0.25),
        ("torus", (0.5, 0, 0), 0.15),
        ("genus_two", (0, 0, 0), 1),
        ("genus_two", (0, 0.5, 0), 4),
        ("iwp", (-1, -1, -1), 2),
        ("neovius", (-1, -1, -1), 13),
        ("steiner", (0, 0, 0), 0),
        ("kummer", (0, 0, 0), 1.3**4 - (3 * 1.3**2 - 1) / (3 - 1.3**2)),
    ],
)
def test_known_values(field, at, expected):
    i, j, k = (round((c + 1) * 2) for c in at)
    assert read(f"synth:{field}:5").values[k, j, i] == pytest.approx(expected, abs=1e-6)


def test_axes_run_in_the_right_order():
    x, y, z = grid(6)
    expected = 2 * (2 * y) * ((2 * y) ** 2 - 3 * (2 * x) ** 2) * (1 - (2 * z) ** 2)
    expected += ((2 * x) ** 2 + (2 * y) ** 2) ** 2 - (9 * (2 * z) ** 2 - 1) * (1 - (2 * z) ** 2)
    np.testing.assert_allclose(read("synth:genus_two:6").values, expected, rtol=1e-6, atol=1e-6)


def genus_two(x, y, z):
    return 2 * y * (y * y - 3 * x * x) * (1 - z * z) + (x * x + y * y) ** 2 - (9 * z * z - 1) * (1 - z * z)


def kummer(x, y, z):
    mu2, root = 1.69, math.sqrt(2)
    product = ((1 - z) ** 2 - (root * x) ** 2) * ((1 + z) ** 2 - (root * y) ** 2)
    return (x * x + y * y + z * z - mu2) ** 2 - (3 * mu2 - 1) / (3 - mu2) * product


def steiner(x, y, z):
    product = ((1 - z) ** 2 - 2 * x * x) * ((1 + z) ** 2 - 2 * y * y)
    return (x * x + y * y + z * z - 1) ** 2 - product


def of_cosines(formula, turns):
    return lambda x, y, z: formula(*(math.cos(turns * math.pi * t) for t in (x + 1, y + 1, z + 1)))


def box(x, y, z):
    a, b, c = Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).inv().apply([x, y, z])
    return min(0.5 - abs(a), 0.4 - abs(b), 0.3 - abs(c))


def holed_box(x, y, z):
    a, b, _ = Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).inv().apply([x, y, z])
    return min(box(x, y, z), math.hypot(a, b) - 0.18)


FORMULAS = {
    "box": box,
    "csg": holed_box,
    "sphere": lambda x, y, z: 0.75 - math.hypot(x, y, z),
    "torus": lambda x, y, z: 0.25 - math.hypot(math.hypot(x, y) - 0.6, z),
    "genus_two": lambda x, y, z: genus_two(2 * x, 2 * y, 2 * z),
    "kummer": lambda x, y, z: kummer(2 * x, 2 * y, 2 * z),
    "steiner": steiner,
    "iwp": of_cosines(lambda a, b, c: a * b + b * c + c * a - a * b * c, 5.01),
    "neovius": of_cosines(lambda a, b, c: 3 * (a + b + c) + 4 * a * b * c, 2),
}


@pytest.mark.parametrize("field", synthetic.FIELDS)
def test_every_node_has_the_value_of_the_papers_formula(field):
    nodes = zip(*(axis.ravel() for axis in grid(6)), strict=True)
    expected = np.reshape([FORMULAS[field](*node) for node in nodes], (6, 6, 6))
    np.testing.assert_allclose(read(f"synth:{field}:6").values, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("field", synthetic.FIELDS)
def test_slabs_do_not_change_a_value(field, monkeypatch):
    whole = read(f"synth:{field}:17").values
    monkeypatch.setattr(synthetic, "SLAB_NODES", 300)
    np.testing.assert_array_equal(read(f"synth:{field}:17").values, whole)


def test_noise_is_the_generators_own_order():
    expected = np.random.default_rng(3).standard_normal((9, 9, 9)).astype(np.float32)
    np.testing.assert_array_equal(read("synth:noise:9", seed=3).values, expected)
    assert (read("synth:noise:9").values != expected).any()


@pytest.mark.parametrize("count", [2, 3, 5, 12])
@pytest.mark.parametrize("sigma", [0.12, 0.13, 0.3, 1.0, 2.5, 7.0])
def test_smooth_noise_is_what_scipy_makes(sigma, count):
    expected = gaussian_filter(np.random.default_rng(0).standard_normal((count, count, count)), sigma)
    np.testing.assert_allclose(read(f"synth:noise:{count}", sigma=sigma).values, expected, atol=1e-6)


def test_smooth_noise_keeps_no_more_planes_than_its_filter_reaches():
    """Nine of sixty, where a plane in double precision has twice the bytes of its values."""
    read("synth:noise:2", sigma=1.0)
    tracemalloc.start()
    values = read("synth:noise:60", sigma=1.0).values
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < values.nbytes + 25 * 60 * 60 * 8


@pytest.mark.parametrize(
    "name", ["synth:", "synth:iwp", "synth:cube:9", "synth:iwp:x", "synth:iwp:-4", "synth:iwp:4:4"]
)
def test_a_wrong_name_tells_the_fields(name):
    with pytest.raises(SettingsError, match="genus_two, iwp"):
        read(name)


def test_one_node_is_too_few_and_a_million_too_many():
    with pytest.raises(VolumeError, match="at least two"):
        read("synth:iwp:1")
    with pytest.raises(MemoryBudgetError, match="MiB needed"):
        read("synth:iwp:100000")
