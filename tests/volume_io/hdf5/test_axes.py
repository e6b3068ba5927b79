"""Axes of HDF5 datasets: what they are called, which are none of space."""

import json

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.hdf5.files import VALUES, codes, nexus, write
from tests.volume_io.reading import counting, read

h5py = pytest.importorskip("h5py")


def test_axes_are_taken_by_their_names(path):
    places = [np.arange(4.0), 2 * np.arange(5.0), 3 * np.arange(6.0)]
    volume = read(nexus(path, ["x", "y", "z"], places, ["mm"] * 3))
    np.testing.assert_array_equal(volume.values, VALUES.T)
    np.testing.assert_allclose(volume.spacing, (1, 2, 3))


def test_projections_are_no_slices(path):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    for label, unit in (("rotation_angle", "degree"), ("rotation_angle", ""), ("theta", "deg"), ("t", "s")):
        with pytest.raises(UnsupportedFormatError, match=rf"the axis {label} in .*projections are no slices"):
            read(nexus(path, [label, "y", "x"], places, [unit, "mm", "mm"]))


@pytest.mark.parametrize(
    ("label", "unit"),
    [
        ("energy", "eV"),
        ("wavelength", "angstrom"),
        ("qz", "1/angstrom"),
        ("time", ""),
        ("a", "K"),
        ("theta", ""),
    ],
)
def test_what_is_no_place_is_no_axis_of_space(path, label, unit):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    with pytest.raises(UnsupportedFormatError, match=rf"the axis {label} in .*expected axes of space"):
        read(nexus(path, [label, "y", "x"], places, [unit, "mm", "mm"]))


@pytest.mark.parametrize("angles", ["theta", "rotation_angle"])
def test_images_with_an_angle_each_are_no_slices(path, angles):
    write(path, {"exchange/data": VALUES, f"exchange/{angles}": np.arange(4.0)})
    with pytest.raises(UnsupportedFormatError, match=rf"an angle a slice in {angles}.*projections"):
        read(path)


def test_axes_of_vigra_are_taken_by_their_names(path):
    """ilastik writes the channels last."""
    values = np.stack([VALUES, VALUES + 1], axis=-1)
    tags = json.dumps({"axes": [{"key": key} for key in "zyxc"]})
    write(path, {"exported_data": values}, axistags=tags)
    with pytest.raises(AmbiguousVolumeError, match=r"2 volumes found \(channel 0 to 1\).*--channel"):
        read(path)
    for choice in ({"channel": "1"}, {"volume_index": 1}):
        np.testing.assert_array_equal(read(path, **choice).values, VALUES + 1)
    assert list_volumes(str(path), ReadSettings())[0].volumes == (
        "channel 0, 6 x 5 x 4",
        "channel 1, 6 x 5 x 4",
    )
    write(
        path,
        {"data": VALUES.T[None, ..., None]},
        axistags=json.dumps({"axes": [{"key": k} for k in "txyzc"]}),
    )
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert codes(volume) == ["W-SPACING-MISSING"]
    write(path, {"data": VALUES}, axistags=json.dumps({"axes": [{"key": "z"}]}))
    with pytest.raises(DamagedVolumeError, match="1 axistags for 3 axes"):
        read(path)


@pytest.mark.parametrize("storage", [{}, {"chunks": (2, 3, 1, 5), "compression": "gzip"}])
def test_a_volume_may_lie_across_the_stored_axes(path, storage):
    values = counting((4, 5, 2, 6), "<i2")
    with h5py.File(path, "w") as file:
        file.create_dataset("data", data=values, **storage)
        for dimension, label in zip(file["data"].dims, ("y", "x", "channel", "z"), strict=True):
            dimension.label = label
    volume = read(path, channel="1")
    np.testing.assert_array_equal(volume.values, values[:, :, 1].transpose(2, 0, 1))


def test_times_that_nexus_names_are_chosen_by_name(path):
    values = counting((3, 4, 5, 6), "<i2")
    places = [np.arange(float(n)) for n in values.shape]
    nexus(path, ["t", "z", "y", "x"], places, ["s", "mm", "mm", "mm"], values)
    volume = read(path, time="2")
    np.testing.assert_array_equal(volume.values, values[2])
    assert volume.warnings == ()


def test_axes_without_names_are_told(path):
    write(path, {"data": np.stack([VALUES, VALUES])})
    assert "W-AXES-MISSING" in codes(read(path, volume_index=1))
    with pytest.raises(AmbiguousVolumeError, match="W-AXES-MISSING"):
        read(path, volume_index=1, spacing=(1, 1, 1), strict=True)
    write(path, {"data": VALUES[None, :, None, :, :, None]})
    volume = read(path, spacing=(1, 1, 1), strict=True)
    np.testing.assert_array_equal(volume.values, VALUES)


def test_an_array_of_matlabs_is_told(path):
    volume = read(write(path, {"data": VALUES}, MATLAB_class=np.bytes_("int16")))
    assert codes(volume) == ["W-AXES-MISSING", "W-SPACING-MISSING"]


def test_a_resolution_of_vigra_has_no_unit(path):
    for resolution, told in ((2.0, ["W-UNIT-MISSING", "W-SPACING-MISSING"]), (0, ["W-SPACING-MISSING"])):
        tags = json.dumps({"axes": [{"key": key, "resolution": resolution} for key in "zyx"]})
        write(path, {"data": VALUES}, axistags=tags)
        assert codes(read(path)) == told
    assert codes(read(path, spacing=(1, 2, 3))) == []
