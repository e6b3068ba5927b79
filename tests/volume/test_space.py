"""Grid indices are mapped to each output space, and its axes have the right names."""

import numpy as np
import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.volume.space import output_affine
from dmc_cli.volume.volume import Volume
from tests.volume_io.reading import LPS_OF_RAS, counting

AFFINE = np.array([[0, 2, 0, 5], [3, 0, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1.0]])


def volume(space, path=""):
    return Volume(values=counting((3, 4, 5)), affine=AFFINE, space=space, path=path)


@pytest.mark.parametrize(
    ("space", "asked", "expected", "called"),
    [
        ("RAS", "native", AFFINE, "RAS"),
        ("LPS", "native", AFFINE, "LPS"),
        ("none", "native", AFFINE, "none"),
        ("RAS", "voxel", np.eye(4), "none"),
        ("none", "voxel", np.eye(4), "none"),
        ("RAS", "ras", AFFINE, "RAS"),
        ("LPS", "lps", AFFINE, "LPS"),
        ("RAS", "lps", LPS_OF_RAS @ AFFINE, "LPS"),
        ("LPS", "ras", LPS_OF_RAS @ AFFINE, "RAS"),
    ],
)
def test_every_space_of_every_volume(space, asked, expected, called):
    affine, name = output_affine(volume(space), asked)
    np.testing.assert_array_equal(affine, expected)
    assert name == called


@pytest.mark.parametrize("asked", ["ras", "lps"])
@pytest.mark.parametrize(("path", "named"), [("a.raw", "a.raw"), ("", "the volume")])
def test_a_volume_without_a_space_has_no_other(asked, path, named):
    with pytest.raises(SettingsError, match=f"--space {asked} was asked for, but {named} does not say how"):
        output_affine(volume("none", path), asked)
