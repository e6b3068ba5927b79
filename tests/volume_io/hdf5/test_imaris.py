"""Imaris files: true sizes, lengths, several channels and times."""

from itertools import product

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.hdf5.files import VALUES, codes
from tests.volume_io.reading import read

h5py = pytest.importorskip("h5py")


def imaris(path, channels=1, unit="um", times=1):
    """As Imaris writes it: chunks filled up, smaller copies, attributes of single characters."""

    def characters(text):
        return np.array(list(text), "S1")

    with h5py.File(path, "w") as file:
        for level, values in enumerate((VALUES, VALUES[::2, ::2, ::2])):
            padded = np.full((8, 8, 8), 77, "<i2")
            padded[tuple(map(slice, values.shape))] = values
            for time, channel in product(range(times), range(channels)):
                place = f"DataSet/ResolutionLevel {level}/TimePoint {time}/Channel {channel}"
                group = file.create_group(place)
                group.create_dataset(
                    "Data", data=padded + channel + 10 * time, chunks=(4, 8, 8), compression="gzip"
                )
                for axis, n in zip("ZYX", values.shape, strict=True):
                    group.attrs[f"ImageSize{axis}"] = characters(str(n))
        told = file.create_group("DataSetInfo/Image").attrs
        for channel in range(channels):
            group = file.create_group(f"DataSetInfo/Channel {channel}")
            group.attrs["Name"] = characters(f"dye {channel}")
        told["Unit"] = characters(unit)
        for n, (first, last) in enumerate(((0, 3), (10, 15), (-2, 6))):
            told[f"ExtMin{n}"], told[f"ExtMax{n}"] = characters(str(first)), characters(str(last))
    return path


def test_an_imaris_file_is_read_without_its_padding(path):
    volume = read(imaris(path.with_suffix(".ims")))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (0.0005, 0.001, 0.002))
    np.testing.assert_allclose(volume.affine[:3, 3], (0.00025, 0.0105, -0.001))
    assert volume.warnings == ()
    coarse = read(f"{imaris(path)}:/DataSet/ResolutionLevel 1/TimePoint 0/Channel 0")
    np.testing.assert_array_equal(coarse.values, VALUES[::2, ::2, ::2])
    np.testing.assert_allclose(coarse.spacing, (0.001, 5e-3 / 3, 0.004))
    imaris(path, channels=2)
    chosen = read(f"{path}:/DataSet/ResolutionLevel 0/TimePoint 0/Channel 1")
    np.testing.assert_array_equal(chosen.values, VALUES + 1)
    assert codes(read(imaris(path, unit="ell"))) == ["W-UNIT-UNKNOWN"]


def test_times_and_channels_of_an_imaris_file_are_chosen(path):
    imaris(path, channels=2, times=3)
    with pytest.raises(
        AmbiguousVolumeError, match=r"6 volumes .*time 0 to 2; channel 0 to 1 \(dye 0, dye 1\)"
    ):
        read(path)
    for choice in ({"time": "2", "channel": "dye 1"}, {"volume_index": 5}):
        volume = read(path, **choice)
        np.testing.assert_array_equal(volume.values, VALUES + 21)
        np.testing.assert_allclose(volume.spacing, (0.0005, 0.001, 0.002))
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes[1] == "time 0, channel 1 (dye 1), 6 x 5 x 4"


def test_a_unit_that_nobody_knows_leaves_the_spacing_to_the_option(path):
    volume = read(imaris(path, unit="ell"), spacing=(1, 2, 3), strict=True)
    assert volume.spacing == pytest.approx((1, 2, 3))
