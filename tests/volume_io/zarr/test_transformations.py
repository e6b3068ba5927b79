"""Transformations of OME-Zarr images, at both levels, in numbers or in arrays of the store."""

import numpy as np
import pytest

from dmc_cli.errors import UnsupportedFormatError, VolumeError
from tests.volume_io.reading import read
from tests.volume_io.zarr.test_images import typed, values_of, write_array, write_image

zarr = pytest.importorskip("zarr")

VALUES = values_of("zyx")


def placed(path, *steps, **image):
    """An image of three axes with the transformations of its level."""
    level = {"coordinateTransformations": list(steps)}
    return write_image(path, VALUES, {"axes": typed("zyx"), "level": level, **image})


def scale(*factors):
    return {"type": "scale", "scale": list(factors)}


def translation(*shifts):
    return {"type": "translation", "translation": list(shifts)}


@pytest.mark.parametrize(
    ("steps", "whole", "spacing", "origin"),
    [
        ([scale(3, 2, 1)], [scale(2, 2, 2), translation(1, 1, 1)], (2, 4, 6), (1, 1, 1)),
        ([translation(1, 2, 3), scale(3, 2, 1)], [], (1, 2, 3), (3, 4, 3)),
        ([scale(3, 2, 1), translation(1, 2, 3)], [{"type": "identity"}], (1, 2, 3), (3, 2, 1)),
        ([{"type": "identity"}], [scale(3, 2, 1)], (1, 2, 3), (0, 0, 0)),
    ],
)
def test_steps_follow_one_another(tmp_path, steps, whole, spacing, origin):
    volume = read(placed(tmp_path / "a.zarr", *steps, coordinateTransformations=whole))
    np.testing.assert_allclose(volume.spacing, 1e-3 * np.array(spacing))
    np.testing.assert_allclose(volume.affine[:3, 3], 1e-3 * np.array(origin))
    assert volume.warnings == ()


def test_numbers_may_lie_in_arrays_of_the_store(tmp_path):
    steps = [{"type": "scale", "path": "scale"}, {"type": "translation", "path": "inner/shift"}]
    path = placed(tmp_path / "a.zarr", *steps)
    write_array(path / "scale", np.array([3.0, 2, 1]))
    write_array(path / "inner" / "shift", np.array([30, 20, 10]))
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, (1e-3, 2e-3, 3e-3))
    np.testing.assert_allclose(volume.affine[:3, 3], (1e-2, 2e-2, 3e-2))


@pytest.mark.parametrize("told", ["0", "../b", "no"])
def test_numbers_that_are_none_are_refused(tmp_path, told):
    with pytest.raises(VolumeError, match=r"which is no array of one axis|leads out of the store"):
        read(placed(tmp_path / "a.zarr", {"type": "scale", "path": told}))


def test_a_place_without_a_distance_is_told(tmp_path):
    volume = read(placed(tmp_path / "a.zarr", translation(30, 20, 10)))
    assert [notice.code for notice in volume.warnings] == ["W-SPACING-MISSING"]
    np.testing.assert_allclose(volume.affine[:3, 3], (1e-2, 2e-2, 3e-2))


@pytest.mark.parametrize("kind", ["affine", "rotation", "sequence"])
def test_other_transformations_are_refused_without_a_scale_too(tmp_path, kind):
    with pytest.raises(UnsupportedFormatError, match=rf"a transformation '{kind}' found"):
        read(placed(tmp_path / "a.zarr", {"type": kind}, coordinateTransformations=[translation(1, 2, 3)]))


@pytest.mark.parametrize("order", ["01", "10"])
def test_the_finest_level_is_taken_wherever_it_stands(tmp_path, order):
    path = placed(tmp_path / "a.zarr", scale(3, 2, 1))
    write_array(path / "1", VALUES[::2, ::2, ::2])
    group = zarr.open_group(path, mode="a", zarr_format=2)
    image = group.attrs["multiscales"][0]
    coarse = {"path": "1", "coordinateTransformations": [scale(6, 4, 2)]}
    levels = {"0": image["datasets"][0], "1": coarse}
    group.attrs["multiscales"] = [image | {"datasets": [levels[n] for n in order]}]
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (1e-3, 2e-3, 3e-3))
