"""Label maps are recognised, scans, masks and rounded fields are not, and converting one is told."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from dmc_cli.volume import Label, Volume, looks_like_labels, told_as_labels


def volume_of(values, **attributes):
    return Volume(values=values, affine=np.eye(4), space="none", **attributes)


def regions(count, shape=(24, 26, 28)):
    """A map of `count` labels and background, in smooth regions."""
    rng = np.random.default_rng(count)
    return np.argmax([gaussian_filter(rng.standard_normal(shape), 3) for _ in range(count + 1)], axis=0)


def field(levels):
    """A smooth field rounded to some levels."""
    noise = gaussian_filter(np.random.default_rng(0).standard_normal((24, 26, 28)), 3)
    return np.rint((noise - noise.min()) / np.ptp(noise) * (levels - 1))


@pytest.mark.parametrize("count", [4, 12, 40])
@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.int32])
def test_a_label_map_is_one(count, dtype):
    assert looks_like_labels(volume_of(regions(count).astype(dtype)))


@pytest.mark.parametrize("levels", [3, 8, 60, 256])
def test_a_rounded_field_is_none(levels):
    assert not looks_like_labels(volume_of(field(levels).astype(np.uint8)))


def test_a_mask_and_noise_and_floats_are_none():
    assert not looks_like_labels(volume_of((regions(3) == 1).astype(np.uint8)))
    noise = np.random.default_rng(0).integers(0, 5, (9, 9, 9), np.uint8)
    assert not looks_like_labels(volume_of(noise))
    assert not looks_like_labels(volume_of(regions(5).astype(np.float32)))


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("sub-01_dseg.nii.gz", True),
        ("aparc+aseg.mgz", True),
        ("brain_label.nrrd", True),
        ("case.seg.nrrd", True),
        ("dsegment.nii", False),
        ("labelled_water.nii", False),
    ],
)
def test_names_hint_at_nested_labels(path, expected):
    nested = np.zeros((12, 12, 12), np.uint8)
    nested[2:10, 2:10, 2:10], nested[4:8, 4:8, 4:8] = 1, 2  # as a rounded field would have them
    assert looks_like_labels(volume_of(nested, path=f"/data/{path}")) == expected


def test_a_file_that_names_several_labels_has_some():
    values = np.zeros((3, 3, 3), np.uint8)
    bone, skin = Label(value=1, number=1, name="bone"), Label(value=2, number=2, name="skin")
    assert looks_like_labels(volume_of(values, labels=(bone, skin)))
    assert not looks_like_labels(volume_of(values, labels=(bone,)))  # a mask


def test_converting_one_at_an_isovalue_is_told(run, tmp_path):
    import nrrd

    nrrd.write(str(tmp_path / "a.nrrd"), regions(6).astype(np.uint8))
    result = run("convert", tmp_path / "a.nrrd", tmp_path / "a.ply", "-i", "0.5")
    assert result.exit_code == 0
    assert "looks like a label map" in result.stderr
    assert "--labels" in result.stderr
    assert told_as_labels(volume_of(regions(6).astype(np.uint8)))[0].code == "W-LABEL-MAP"
    assert told_as_labels(volume_of(field(8).astype(np.uint8))) == ()
