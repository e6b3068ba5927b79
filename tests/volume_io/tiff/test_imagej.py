"""What ImageJ's metadata tell of a TIFF: distances and their units, the origin, what values mean."""

import numpy as np
import pytest

from dmc_cli.errors import UnsupportedFormatError
from tests.volume_io.reading import counting, read

tifffile = pytest.importorskip("tifffile")

VALUES = counting((6, 16, 20), "<u2")


def test_spacing_of_imagej(tmp_path):
    tifffile.imwrite(
        tmp_path / "a.tif",
        VALUES,
        imagej=True,
        resolution=(1 / 0.25, 1 / 0.5),
        metadata={"spacing": 2.0, "unit": "um", "axes": "ZYX"},
    )
    np.testing.assert_allclose(read(tmp_path / "a.tif").spacing, (0.00025, 0.0005, 0.002))


def imagej(path, **metadata):
    told = {"spacing": 2.0, "unit": "mm", "axes": "ZYX", **metadata}
    told = {key: value for key, value in told.items() if value is not None}
    tifffile.imwrite(path, VALUES, imagej=True, resolution=(4, 2), metadata=told)
    return path


@pytest.mark.parametrize(
    ("metadata", "spacing", "told"),
    [
        ({}, (0.25, 0.5, 2), []),
        ({"unit": None}, (0.25, 0.5, 2), ["W-UNIT-MISSING"]),
        ({"unit": "pixel"}, (0.25, 0.5, 2), ["W-UNIT-UNKNOWN"]),
        ({"unit": "inch"}, (6.35, 12.7, 50.8), []),
        ({"unit": "cm"}, (2.5, 5, 20), []),
        ({"unit": "\\u00B5m"}, (0.00025, 0.0005, 0.002), []),
        ({"unit": "micron"}, (0.00025, 0.0005, 0.002), []),
        ({"unit": "\\u00C5"}, (0.25e-7, 0.5e-7, 2e-7), []),
        ({"unit": "nm"}, (0.25e-6, 0.5e-6, 2e-6), []),
        ({"unit": "um", "zunit": "mm"}, (0.00025, 0.0005, 2), []),
        ({"spacing": -2.0}, (0.25, 0.5, 2), []),
    ],
)
def test_units_of_imagej(tmp_path, metadata, spacing, told):
    volume = read(imagej(tmp_path / "a.tif", **metadata))
    np.testing.assert_allclose(volume.spacing, spacing)
    assert [notice.code for notice in volume.warnings] == told


def test_a_unit_of_time_is_no_length(tmp_path):
    with pytest.raises(UnsupportedFormatError, match=r"the axis x of space found in 'sec', a unit of time"):
        read(imagej(tmp_path / "a.tif", unit="sec"))


def test_the_spacing_given_counts_where_the_unit_is_unknown(tmp_path):
    volume = read(imagej(tmp_path / "a.tif", unit="pixel"), spacing=(1, 2, 3))
    assert (volume.spacing, volume.sentences) == ((1, 2, 3), ())


def test_imagej_without_a_spacing_tells_that_along_x_and_y(tmp_path):
    volume = read(imagej(tmp_path / "a.tif", spacing=None))
    assert (volume.spacing, volume.sentences) == (
        (0.25, 0.5, 1),
        ("the TIFF tells no spacing along z; 1 mm is taken; --spacing gives it",),
    )


@pytest.mark.parametrize("unit", [None, "", "pixel"])
def test_imagej_without_a_spacing_and_a_length_tells_none(tmp_path, unit):
    assert read(imagej(tmp_path / "a.tif", spacing=None, unit=unit)).sentences == (
        "the TIFF tells no spacing; 1 mm is taken; --spacing gives it",
    )


@pytest.mark.parametrize(("unit", "length"), [("INCH", 25.4), ("CENTIMETER", 10)])
def test_the_unit_of_the_resolution_is_imagej_s_where_it_names_none(tmp_path, unit, length):
    told = {"imagej": True, "resolution": (4, 2), "metadata": {"axes": "ZYX", "spacing": 2.0}}
    tifffile.imwrite(tmp_path / "a.tif", VALUES, resolutionunit=unit, **told)
    volume = read(tmp_path / "a.tif")
    np.testing.assert_allclose(volume.spacing, np.array((0.25, 0.5, 2)) * length)
    assert volume.sentences == ()


def test_the_origin_of_imagej(tmp_path):
    told = {"xorigin": 10.0, "yorigin": -3.0, "zorigin": 0.5}
    volume = read(imagej(tmp_path / "a.tif", **told))
    np.testing.assert_allclose(volume.affine[:3, 3], (-2.5, 1.5, -1))
    volume = read(imagej(tmp_path / "a.tif", unit="pixel", **told), spacing=(1, 2, 3), origin=(7, 8, 9))
    np.testing.assert_allclose(volume.affine[:3, 3], (-10, 6, -1.5))
    assert [notice.code for notice in volume.warnings] == ["W-OPTION-UNUSED"]


@pytest.mark.parametrize(
    ("calibration", "scale", "told"),
    [
        ({"cf": 0, "c0": -32768.0, "c1": 1.0}, (1, -32768), []),
        ({"cf": 0, "c0": 5.0, "c1": -0.25, "vunit": "HU"}, (-0.25, 5), []),
        ({"cf": 0, "c0": 5.0}, (1, 0), []),
        ({"cf": 20, "c0": 5.0, "c1": 2.0}, (1, 0), []),
        ({"cf": 1, "c0": 5.0, "c1": 2.0, "c2": 3.0}, (1, 0), ["W-VALUES-MAPPED"]),
        ({"cf": 21}, (1, 0), ["W-VALUES-MAPPED"]),
        ({"cf": 0, "c0": 5.0, "c1": 0.0}, (1, 0), ["W-RESCALE-UNKNOWN"]),
    ],
)
def test_the_values_of_imagej_are_calibrated(tmp_path, calibration, scale, told):
    """Calibration.java: 0 is a straight line, 20 none, 21 optical density; one number alone is none."""
    volume = read(imagej(tmp_path / "a.tif", **calibration))
    assert (volume.slope, volume.intercept) == scale
    assert [notice.code for notice in volume.warnings] == told


def test_a_resolution_that_is_not_there_is_one(tmp_path):
    path = imagej(tmp_path / "a.tif")
    with tifffile.TiffFile(path, mode="r+b") as file:
        for tag in ("XResolution", "YResolution"):
            place = file.pages[0].tags[tag].offset
            file.filehandle.seek(place)
            file.filehandle.write((65000 + (tag == "YResolution")).to_bytes(2, "little"))
    np.testing.assert_allclose(read(path).spacing, (1, 1, 2))
