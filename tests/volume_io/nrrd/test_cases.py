"""NRRD files as segmentation programs and micro-CT scanners write them (shared/cases/nrrd_odd)."""

import numpy as np

from tests.cases import case
from tests.volume_io.reading import read


def test_layers_of_a_segmentation_are_volumes():
    volume = read(case("nrrd_odd/seg_layers.seg.nrrd"), volume_index=1)
    assert volume.shape == (32, 28, 24)
    np.testing.assert_allclose(volume.affine, [[0.5, 0, 0, 1], [0, 0.6, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])
    assert (volume.space, volume.warnings) == ("LPS", ())


def test_vectors_with_blanks_after_commas():
    volume = read(case("nrrd_odd/int16_spaces_after_comma.nrrd"))
    np.testing.assert_allclose(volume.affine, [[0.5, 0, 0, 1], [0, 0.6, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])
    assert (volume.space, volume.warnings) == ("LPS", ())


def test_a_header_beside_a_scanco_file():
    volume = read(case("nrrd_odd/scanco.nhdr"))
    assert volume.shape == (32, 28, 24)
    np.testing.assert_allclose(volume.spacing, (0.02,) * 3)
    assert [notice.code for notice in volume.warnings] == ["W-UNIT-MISSING"]  # as the header has none


def test_a_direction_that_is_no_number_beside_the_axes_of_space_is_none():
    volume = read(case("nrrd_odd/nan_direction.nrrd"), volume_index=1)
    np.testing.assert_allclose(volume.affine, [[0.5, 0, 0, 1], [0, 0.6, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])
    assert (volume.space, volume.warnings) == ("LPS", ())
