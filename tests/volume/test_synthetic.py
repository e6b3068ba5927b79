import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from dmc_cli.errors import MemoryBudgetError, SettingsError, VolumeError
from dmc_cli.volume import synthetic
from tests.volume.reading import read


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


@pytest.mark.parametrize("field", synthetic.FIELDS)
def test_slabs_do_not_change_a_value(field, monkeypatch):
    whole = read(f"synth:{field}:17").values
    monkeypatch.setattr(synthetic, "SLAB_NODES", 300)
    np.testing.assert_array_equal(read(f"synth:{field}:17").values, whole)


def test_noise_is_the_generators_own_order():
    expected = np.random.default_rng(3).standard_normal((9, 9, 9)).astype(np.float32)
    np.testing.assert_array_equal(read("synth:noise:9", seed=3).values, expected)
    assert (read("synth:noise:9").values != expected).any()


@pytest.mark.parametrize("sigma", [0.3, 1.0, 2.5])
def test_smooth_noise_is_what_scipy_makes(sigma):
    expected = gaussian_filter(np.random.default_rng(0).standard_normal((12, 12, 12)), sigma)
    np.testing.assert_allclose(read("synth:noise:12", sigma=sigma).values, expected, atol=1e-6)


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
