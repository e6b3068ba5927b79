"""Where HDF5 datasets lie: places along the axes, ITK's geometry, lengths that attributes tell."""

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from tests.volume_io.hdf5.files import VALUES, codes, nexus, write
from tests.volume_io.reading import assert_same_as_itk, read

h5py = pytest.importorskip("h5py")


def test_what_nexus_shows_is_read_with_its_axes(path):
    places = [2 + 0.5 * np.arange(4), np.arange(5) * 100.0, 7e-6 * np.arange(6)]
    volume = read(nexus(path, ["z", "y", "x"], places, ["mm", "um", "m"]))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (0.007, 0.1, 0.5))
    np.testing.assert_allclose(volume.affine[:3, 3], (0, 0, 2))
    assert volume.warnings == ()


def test_axes_with_unknown_or_no_unit_or_uneven_places(path):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    volume = read(nexus(path, ["z", "y", "x"], places, ["", "parasang", "mm"]))
    assert codes(volume) == ["W-UNIT-MISSING", "W-UNIT-UNKNOWN", "W-SPACING-MISSING"]
    places[0][2] += 0.5
    with pytest.raises(UnsupportedFormatError, match="along the axis z found that are not even"):
        read(nexus(path, ["z", "y", "x"], places, ["mm"] * 3))


def test_scales_of_dimensions_are_places(path):
    with h5py.File(path, "w") as file:
        file["data"] = VALUES
        for k, (label, step) in enumerate((("z", 3.0), ("y", 2.0), ("x", 1.0))):
            file[label] = step * np.arange(VALUES.shape[k])
            file[label].attrs["units"] = "um"
            file[label].make_scale(label)
            file["data"].dims[k].attach_scale(file[label])
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, (0.001, 0.002, 0.003))
    assert volume.warnings == ()


def test_places_along_some_axes_only_are_told(path):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    nexus(path, ["z", "y", "x"], places, ["mm"] * 3)
    with h5py.File(path, "a") as file:
        del file["entry/data/z"]
    volume = read(path)
    assert codes(volume) == ["W-SPACING-MISSING", "W-SPACING-MISSING"]
    assert "no places along z" in volume.warnings[0].sentence


def test_element_sizes_are_read_and_loose_lengths_told(path):
    volume = read(write(path, {"data": VALUES}, element_size_um=[3.0, 2.0, 1.0]))
    np.testing.assert_allclose(volume.spacing, (0.001, 0.002, 0.003))
    assert volume.warnings == ()
    volume = read(write(path, {"data": VALUES}, resolution=[40.0, 4.0, 4.0]))
    assert codes(volume) == ["W-UNIT-MISSING", "W-SPACING-MISSING"]
    assert "'resolution'" in volume.warnings[0].sentence


@pytest.mark.parametrize("size", [0.0, -3.0, np.nan, np.inf])
def test_sizes_that_are_no_lengths_are_refused_or_told(path, size):
    with pytest.raises(DamagedVolumeError, match="expected positive lengths"):
        read(write(path, {"data": VALUES}, element_size_um=[size, 2.0, 1.0]))
    volume = read(write(path, {"data": VALUES}, pixel_size_um=size))
    assert (volume.spacing, codes(volume)) == ((1, 1, 1), ["W-SPACING-MISSING", "W-SPACING-MISSING"])
    assert "which are no lengths and not used" in volume.sentences[0]


@pytest.mark.parametrize(
    ("attributes", "spacing"),
    [
        ({"pixel_size_um": 12.0}, 0.012),
        ({"voxel_size": [5.0, 5.0, 5.0], "unit": "nm"}, 5e-6),
        ({"resolution": 2.0, "units": "mm"}, 2.0),
        ({"spacing": 3.0, "units": ["um", "um", "um"]}, 0.003),
        ({"voxel_size": [1.0, 2.0, 3.0], "unit": "um"}, "W-SPACING-MISSING"),
        ({"voxel_size_um": [1.0, 2.0, 3.0]}, "W-SPACING-MISSING"),
        ({"voxel_size": 1.0, "units": ["um", "nm", "um"]}, "W-UNIT-MISSING"),
    ],
)
@pytest.mark.parametrize("owner", ["entry/data", "entry", "/"])
def test_one_length_with_its_unit_counts(path, attributes, spacing, owner):
    write(path, {"entry/data": VALUES})
    with h5py.File(path, "a") as file:
        file[owner].attrs.update(attributes)
    volume = read(path)
    if isinstance(spacing, str):
        assert codes(volume)[0] == spacing
        assert volume.spacing == (1, 1, 1)
    else:
        assert volume.spacing == pytest.approx((spacing,) * 3)
        assert volume.warnings == ()


def test_an_image_that_itk_wrote_agrees_with_it(path):
    image = sitk.GetImageFromArray(VALUES)
    image.SetSpacing((1, 2, 3))
    image.SetOrigin((7, 8, 9))
    image.SetDirection((0, 1, 0, 0, 0, 1, 1, 0, 0))
    sitk.WriteImage(image, str(path))
    volume = read(path)
    assert_same_as_itk(volume, path)
    assert volume.space == "LPS"
    assert volume.warnings == ()


def test_components_of_itk_are_volumes_to_choose_from(path):
    image = sitk.GetImageFromArray(np.stack([VALUES, VALUES + 1], axis=-1), isVector=True)
    sitk.WriteImage(image, str(path))
    np.testing.assert_array_equal(read(path, channel="1").values, VALUES + 1)
