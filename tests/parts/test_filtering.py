"""Smoothing is a Gaussian; resampling keeps linear fields, makes no aliases, puts nodes where it says."""

import json

import numpy as np
import pytest
from scipy import ndimage

from dmc_cli.errors import SettingsError
from dmc_cli.parts import resampled_shape, resampled_volume, smoothed_volume
from dmc_cli.runtime import select_device
from dmc_cli.volume import Volume

AFFINE = np.array([[0.0, -1.0, 0, 7], [1.0, 0, 0, -3], [0, 0, 2.0, 5], [0, 0, 0, 1]])
SHAPE = (12, 15, 40)


@pytest.fixture
def on(device):
    return select_device(device, 2)


def volume_of(values, **given):
    return Volume(values=np.asarray(values), affine=AFFINE, space="RAS", **given)


def physical(volume):
    return volume.slope * volume.values.astype(np.float64) + volume.intercept


def places(volume):
    k, j, i = np.meshgrid(*[np.arange(n, dtype=float) for n in volume.values.shape], indexing="ij")
    if volume.slice_positions is not None:
        k = (volume.slice_positions / volume.spacing[2])[:, None, None] + 0 * k
    return np.stack([i, j, k], -1) @ volume.affine[:3, :3].T + volume.affine[:3, 3]


def gaussian(values):
    return ndimage.gaussian_filter(values.astype(np.float64), (0.5, 1, 1), truncate=4, mode="nearest")


@pytest.mark.parametrize("dtype", ["uint8", "int16", "int32", "float32", "float64"])
def test_smoothing_is_a_gaussian_in_mm(on, dtype):
    values = np.random.default_rng(0).integers(0, 200, SHAPE).astype(dtype)
    shift = 10**9 if dtype in ("int32", "float64") else 0
    found = smoothed_volume(
        volume_of(values + np.dtype(dtype).type(shift), slope=-2.0, intercept=5.0), 1.0, on
    )
    np.testing.assert_allclose(physical(found), -2.0 * (gaussian(values) + shift) + 5.0, atol=1e-3)


def test_nodes_without_data_weigh_nothing_and_stay_so(on):
    values = np.random.default_rng(0).integers(0, 200, SHAPE).astype(np.int16)
    data = values > 20
    found = smoothed_volume(volume_of(values, padding=(0, 20)), 1.0, on)
    np.testing.assert_array_equal(np.isnan(found.values), ~data)
    expected = gaussian(np.where(data, values, 0)) / gaussian(data)
    np.testing.assert_allclose(found.values[data], expected[data], rtol=1e-5)


@pytest.mark.parametrize("step", ["isotropic", "0.5", "1.3", "2.6", "3"])
def test_a_linear_field_stays_what_it_was(on, step):
    source = volume_of(np.zeros(SHAPE))
    weights = np.array([3.0, 2.0, -1.0])
    found = resampled_volume(volume_of(places(source) @ weights), step, on)
    assert found.shape == resampled_shape(source, step)
    distance = 1.0 if step == "isotropic" else float(step)
    np.testing.assert_allclose(found.spacing, [distance] * 3)
    error = np.abs(physical(found) - places(found) @ weights)
    reach = (slice(2, -2),) * 3 if distance > 1 else (slice(None),) * 3
    assert error[reach].max() < (0.5 if distance % 1 else 1e-4)


def test_what_is_finer_than_the_new_nodes_is_averaged(on):
    stripes = np.zeros((20, 20, 60)) + 100.0 * (np.arange(60) % 2)
    source = Volume(values=stripes, affine=np.eye(4), space="none")
    found = resampled_volume(source, "4", on).values
    assert np.abs(physical(resampled_volume(source, "4", on))[2:-2, 2:-2, 2:-2] - 50).max() < 1.0
    assert found.shape == (5, 5, 15)


def test_uneven_slices_become_even(on):
    positions = np.cumsum([0.0, 1, 1, 2, 3, 1, 1, 1])
    affine = np.diag([1.0, 1.0, positions[-1] / 7, 1.0])
    source = Volume(values=np.zeros((8, 9, 10)), affine=affine, space="none", slice_positions=positions)
    weights = np.array([1.0, -2.0, 4.0])
    ramp = Volume(values=places(source) @ weights, affine=affine, space="none", slice_positions=positions)
    found = resampled_volume(ramp, "0.5", on)
    assert found.slice_positions is None
    np.testing.assert_allclose(physical(found), places(found) @ weights, atol=1e-4)


@pytest.mark.parametrize("step", ["1000", "0.0001"])
def test_distances_that_make_no_volume_are_refused(on, step):
    with pytest.raises(SettingsError, match=r"resample is .*, which makes \d+ nodes along x of 40"):
        resampled_volume(volume_of(np.zeros(SHAPE)), step, on)


def test_a_gaussian_that_changes_nothing_is_refused(on):
    with pytest.raises(SettingsError, match=r"expected at least 0\.1 mm"):
        smoothed_volume(volume_of(np.zeros(SHAPE)), 0.01, on)


def test_the_command_smooths_and_resamples(run, tmp_path):
    words = ["convert", "synth:sphere:40", tmp_path / "a.ply", "-i", 0, "--report", tmp_path / "a.json"]
    more = [
        "--resample",
        "0.08",
        "--smooth-volume",
        "0.05",
        "--require",
        "closed,manifold,on-surface",
        "--check",
    ]
    result = run(*words, *more)
    assert result.exit_code == 0, result.stderr
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["part"]["filtered"]["shape"] == [26, 26, 26]
    assert report["input"]["shape"] == [40, 40, 40]
    assert report["mesh"]["volume"] == pytest.approx(4 / 3 * np.pi * 0.75**3, rel=0.05)
    assert "values at 26 x 26 x 26 nodes, 0.08 x 0.08 x 0.08 mm apart" in result.stderr
