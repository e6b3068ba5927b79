"""Synthetic fields know their gradients and themselves: as finite differences and the nodes' values say."""

import numpy as np
import pytest

from dmc_cli.errors import VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.sharp_fields import HALF, TURN
from dmc_cli.volume_io.synthetic import FIELDS, field_formula, field_gradient
from tests.fields import volume_of

STEP = 1e-6


@pytest.mark.parametrize("field", FIELDS)
def test_the_gradient_is_that_of_finite_differences(field):
    points = np.random.default_rng(3).uniform(-0.9, 0.9, (400, 3))
    formula, found = field_formula(field), field_gradient(field)(points)
    for axis in range(3):
        step = STEP * np.eye(3)[axis]
        expected = (formula(points + step) - formula(points - step)) / (2 * STEP)
        difference = np.abs(found[:, axis] - expected)
        assert np.quantile(difference, 0.99) < 1e-5 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("field", FIELDS)
def test_the_formula_is_that_of_the_nodes(field):
    volume = read_volume(f"synth:{field}:9", ReadSettings())
    k, j, i = np.indices((9, 9, 9))
    nodes = np.stack([i, j, k], axis=-1).reshape(-1, 3) * volume.spacing - 1.0
    np.testing.assert_allclose(volume.formula(nodes), volume.values.ravel(), rtol=1e-6, atol=1e-6)


def test_noise_knows_nothing():
    volume = read_volume("synth:noise:6", ReadSettings())
    assert volume.gradient is volume.formula is None


def test_the_box_is_turned_and_has_its_sides():
    np.testing.assert_allclose(TURN.T @ TURN, np.eye(3), atol=1e-15)
    assert np.linalg.det(TURN) == pytest.approx(1.0)
    formula = field_formula("box")
    for k in range(3):
        assert formula((TURN[:, k] * HALF[k])[None])[0] == pytest.approx(0.0, abs=1e-15)
    assert formula(np.zeros((1, 3)))[0] == min(HALF)
    assert np.abs(TURN).max() < 0.99


@pytest.mark.parametrize("name", ["gradient", "formula"])
def test_what_is_no_function_is_refused(name):
    with pytest.raises(VolumeError, match=f"{name} is 3; expected a function of points"):
        volume_of(np.zeros((2, 2, 2)), **{name: 3})
