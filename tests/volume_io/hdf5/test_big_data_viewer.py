"""BigDataViewer files: a dataset for each time and setup, and the XML beside them."""

from itertools import product

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.hdf5.big_data_viewer_files import (
    CALIBRATION,
    CHANNELS,
    VALUES,
    value,
    write_big_data_viewer,
    write_xml,
)
from tests.volume_io.hdf5.files import codes
from tests.volume_io.reading import read

h5py = pytest.importorskip("h5py")

NAMES = (
    '<Attributes name="channel"><Channel><id>0</id><name>GFP</name></Channel>'
    "<Channel><id>1</id><name>RFP</name></Channel></Attributes>"
)


def test_times_and_channels_are_listed_and_chosen(path):
    write_big_data_viewer(path, times=(0, 1, 2), setups=2)
    xml = write_xml(path.with_suffix(".xml"), CHANNELS, times=3, names=NAMES)
    for each in (path, xml):
        with pytest.raises(
            AmbiguousVolumeError, match=r"time 0 to 2; channel 0 to 1 \(GFP, RFP\).*--channel"
        ):
            read(each)
        (entry,) = list_volumes(str(each), ReadSettings())
        assert entry.volumes[3] == "time 1, channel 1 (RFP), 6 x 5 x 4"
        for choice in ({"time": "2", "channel": "rfp"}, {"volume_index": 5}):
            volume = read(each, **choice)
            np.testing.assert_array_equal(volume.values, value(2, 1))
            np.testing.assert_allclose(volume.spacing, (0.0005, 0.0005, 0.002))
            assert (volume.warnings, volume.files) == ((), (path, xml))


def test_values_are_without_a_sign(path):
    write_big_data_viewer(path)
    with h5py.File(path, "a") as file:
        file["t00000/s00/0/cells"][0, 0, 0] = -1
    volume = read(path)
    assert (volume.values.dtype, volume.values[0, 0, 0]) == (np.uint16, 65535)


def test_setups_without_the_xml_are_numbered(path):
    write_big_data_viewer(path, times=(3, 5), setups=2)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes[2] == "time 1 (t5), setup 0, 6 x 5 x 4"
    volume = read(path, time="t5", volume_index=1)
    np.testing.assert_array_equal(volume.values, value(5, 1))
    assert codes(volume) == ["W-SPACING-MISSING"]


def test_setups_that_are_a_grid_of_attributes_have_an_axis_each(path):
    write_big_data_viewer(path, setups=4)
    attributes = [f"<channel>{c}</channel><angle>{a}</angle>" for a, c in product((0, 45), (0, 1))]
    write_xml(path.with_suffix(".xml"), attributes)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes[1] == "channel 0, angle 1, 6 x 5 x 4"
    np.testing.assert_array_equal(read(path, channel="0", volume_index=1).values, value(0, 2))


def test_setups_of_several_grids_are_images_of_their_own(path):
    write_big_data_viewer(path, setups=2, shapes={1: 3})
    write_xml(path.with_suffix(".xml"), CHANNELS)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes == (
        "setup 0 (view 0), 6 x 5 x 4",
        "setup 1 (view 1), 6 x 5 x 3",
    )
    np.testing.assert_array_equal(read(path, volume_index=1).values, value(0, 1)[:3])


def test_a_dataset_is_named_as_in_any_file(path):
    write_big_data_viewer(path)
    write_xml(path.with_suffix(".xml"), CHANNELS[:1])
    coarse = read(f"{path}:/t00000/s00/1/cells")
    np.testing.assert_array_equal(coarse.values, VALUES[:, ::2, ::2])
    np.testing.assert_allclose(coarse.spacing, (0.001, 0.001, 0.002))
    np.testing.assert_allclose(coarse.affine[:3, 3], (0.00025, 0.00025, 0))


@pytest.mark.parametrize(
    ("affines", "origin", "told"),
    [
        ((), (0, 0, 0), []),
        (("1 0 0 10 0 1 0 20 0 0 1 30", CALIBRATION), (0.01, 0.02, 0.03), []),
        (("1 0 0 10 0 1 0 0 0 0 4 0",), (0.005, 0, 0), []),
        (("0 1 0 0 -1 0 0 0 0 0 1 0", CALIBRATION), (0, 0, 0), ["W-GEOMETRY-CONTRADICTED"]),
        (("1 0 0 0 0 1 0 0 0 0 1 0",), (0, 0, 0), ["W-GEOMETRY-CONTRADICTED"]),
        (("1 0.2 0 0 0 1 0 0 0 0 4 0",), (0, 0, 0), ["W-GEOMETRY-CONTRADICTED"]),
    ],
)
def test_a_registration_places_a_view_or_is_told(path, affines, origin, told):
    """In voxels of the finest axis, as the multiview reconstruction has it, or in the unit."""
    write_big_data_viewer(path)
    write_xml(path.with_suffix(".xml"), CHANNELS[:1], affines=affines)
    volume = read(path)
    np.testing.assert_allclose(volume.affine[:3, 3], origin, atol=1e-12)
    np.testing.assert_allclose(volume.spacing, (0.0005, 0.0005, 0.002))
    assert codes(volume) == told


@pytest.mark.parametrize(
    ("unit", "told"), [("px", "W-UNIT-UNKNOWN"), ("", "W-UNIT-MISSING"), ("\xb5m", None), ("nm", None)]
)
def test_the_unit_of_a_voxel(path, unit, told):
    write_big_data_viewer(path)
    xml = path.with_suffix(".xml")
    write_xml(xml, CHANNELS[:1], unit="@", size="0.5 0.5 2")
    xml.write_bytes(xml.read_text().replace("@", unit).encode())
    assert codes(read(path)) == ([told] if told else [])
    if told:
        assert read(path, spacing=(1, 2, 3), strict=True).spacing == pytest.approx((1, 2, 3))


def test_an_xml_of_another_file_is_not_read(path):
    write_big_data_viewer(path)
    write_xml(path.with_suffix(".xml"), CHANNELS[:1], file="other.h5")
    assert codes(read(path)) == ["W-SPACING-MISSING"]
    path.with_suffix(".xml").write_text("<other/>")
    assert codes(read(path)) == ["W-SPACING-MISSING"]


@pytest.mark.parametrize(
    ("change", "error", "told"),
    [
        (
            ('"bdv.hdf5"><hdf5 type="relative">a.h5</hdf5>', '"bdv.n5"><n5>a.n5</n5>'),
            UnsupportedFormatError,
            "the image loader 'bdv.n5' found",
        ),
        ((">a.h5<", ">gone.h5<"), VolumeError, r"its data file 'gone\.h5' is not there"),
        ((">a.h5<", ">../a.h5<"), VolumeError, "is not there|lies outside the header's folder"),
        (("<SpimData ", "<!DOCTYPE x><SpimData "), DamagedVolumeError, "with entities found"),
        (("</SpimData>", ""), DamagedVolumeError, "the XML cannot be read"),
        (("0.5 0.5 2", "0.5 0 2"), DamagedVolumeError, "expected positive lengths"),
        (("0.5 0 0 0", "0.5 0 0"), DamagedVolumeError, "cannot be read"),
    ],
)
def test_an_xml_that_cannot_be_used_is_refused(path, change, error, told):
    write_big_data_viewer(path)
    xml = write_xml(path.with_suffix(".xml"), CHANNELS[:1])
    text = xml.read_text()
    assert change[0] in text
    xml.write_text(text.replace(*change))
    with pytest.raises(error, match=told):
        read(xml)


def test_a_view_that_is_missing_is_told(path):
    write_big_data_viewer(path, times=(0, 1))
    with h5py.File(path, "a") as file:
        del file["t00001/s00"]
    assert read(path, time="0").values[0, 0, 1] == 1
    with pytest.raises(DamagedVolumeError, match=r"no image t00001/s00/0/cells .*the view is missing"):
        read(path, time="1")
