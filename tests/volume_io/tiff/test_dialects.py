"""Lengths in the tags of microscopes and other programs are used where they leave nothing open."""

import numpy as np
import pytest

from dmc_cli.errors import UnsupportedFormatError
from tests.volume_io.reading import counting, read
from tests.volume_io.tiff import programs

VALUES = counting((3, 6, 8), "<u2")


def codes(volume):
    return [notice.code for notice in volume.warnings]


def test_voxels_of_zeiss_lsm_are_in_metres(tmp_path):
    volume = read(programs.write_lsm(tmp_path / "a.lsm", VALUES, (1e-7, 2e-7, 5e-7)))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (1e-4, 2e-4, 5e-4))
    assert codes(volume) == []
    volume = read(programs.write_lsm(tmp_path / "b.lsm", VALUES, (1e-7, 2e-7, 0)))
    assert codes(volume) == ["W-SPACING-MISSING"]
    assert "along z; 1 mm is taken" in volume.sentences[0]
    assert read(tmp_path / "b.lsm", spacing=(1, 2, 3)).spacing == (1, 2, 3)


@pytest.mark.parametrize(
    ("changes", "spacing", "told"),
    [
        ({}, (0.0005, 0.0005, 0.0015), []),
        ({"unit": "nm"}, (0.5e-6, 0.5e-6, 1.5e-6), []),
        ({"unit": "pixel"}, (0.5, 0.5, 1.5), ["W-UNIT-UNKNOWN"]),
        ({"steps": [(0, 1), (3, 2), (3, 2)]}, (0.0005, 0.0005, 0.0015), ["W-AXES-MISSING"]),
        ({"steps": [(3, 2), (3, 2), (4, 2)]}, (0.0005, 0.0005, 0.001), ["W-SPACING-MISSING"]),
        ({"is_calibrated": 0}, (0.001, 0.001, 0.0015), ["W-SPACING-MISSING"]),
    ],
)
def test_calibrations_of_metamorph(tmp_path, changes, spacing, told):
    volume = read(programs.write_stk(tmp_path / "a.stk", VALUES, **{"steps": [(3, 2)] * 3, **changes}))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, spacing)
    assert codes(volume) == told


def test_planes_of_metamorph_at_other_times_are_no_slices(tmp_path):
    path = programs.write_stk(tmp_path / "a.stk", VALUES, [(0, 1)] * 3, times=[0, 500, 1000])
    with pytest.raises(UnsupportedFormatError, match="time 3, y 6, x 8"):
        read(path)


def test_axes_of_fluoview(tmp_path):
    axes = [("X", 8, 0.5, "um"), ("Y", 6, 0.25, "um"), ("Z", 3, 2.0, "um")]
    volume = read(programs.write_fluoview(tmp_path / "a.tif", VALUES, axes))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (5e-4, 2.5e-4, 2e-3))
    assert codes(volume) == []
    axes[2] = ("T", 3, 2.0, "s")
    with pytest.raises(UnsupportedFormatError, match="time 3"):
        read(programs.write_fluoview(tmp_path / "a.tif", VALUES, axes))


@pytest.mark.parametrize(
    ("write", "options", "across", "told"),
    [
        (programs.write_fei, {}, (5e-6, 6e-6), ["W-SPACING-MISSING"]),
        (programs.write_fei, {"x": "0"}, (1, 6e-6), ["W-SPACING-MISSING"]),
        (programs.write_sem, {}, (5.585e-6, 5.585e-6), ["W-SPACING-MISSING"]),
        (programs.write_sem, {"pixel": "Image Pixel Size = 1.2 µm"}, (1.2e-3, 1.2e-3), ["W-SPACING-MISSING"]),
        (programs.write_nih, {}, (2.5e-4, 2.5e-4), ["W-SPACING-MISSING"]),
        (programs.write_nih, {"unit": 3, "version": 152}, (2.5, 2.5), ["W-SPACING-MISSING"]),
        (programs.write_nih, {"unit": 5, "aspect": 2.0}, (2.5e-7, 1.25e-7), ["W-SPACING-MISSING"]),
        (programs.write_nih, {"scale": 0.0}, (1, 1), ["W-SPACING-MISSING"]),
        (programs.write_nih, {"unit": 14}, (1, 1), ["W-SPACING-MISSING"]),
        (programs.write_geotiff, {}, (2000, 3000), []),
        (programs.write_geotiff, {"unit": 9002}, (609.6, 914.4), []),
        (programs.write_geotiff, {"unit": None}, (2, 3), ["W-UNIT-MISSING"]),
        (programs.write_geotiff, {"model": 2}, (1, 1), ["W-SPACING-MISSING"]),
        (programs.write_metaseries, {}, (2.5e-4, 5e-4), ["W-AXES-MISSING", "W-SPACING-MISSING"]),
        (programs.write_metaseries, {"state": "off"}, (1, 1), ["W-AXES-MISSING", "W-SPACING-MISSING"]),
        (programs.write_micromanager, {}, (3.25e-4, 3.25e-4), ["W-AXES-MISSING", "W-SPACING-MISSING"]),
    ],
)
@pytest.mark.parametrize("is_folder", [False, True])
def test_pixels_of_other_programs(tmp_path, write, options, across, told, is_folder):
    """In a file of pages, and in slices that are a file each."""
    if is_folder:
        for k, plane in enumerate(VALUES):
            write(tmp_path / f"{k}.tif", plane, **options)
    else:
        write(tmp_path / "a.tif", VALUES, **options)
    volume = read(tmp_path if is_folder else tmp_path / "a.tif")
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing[:2], across)
    assert codes(volume) == [code for code in told if not (is_folder and code == "W-AXES-MISSING")]
    assert read(tmp_path, spacing=(1, 2, 3)).spacing == ((1, 2, 3) if told else volume.spacing)


@pytest.mark.parametrize(
    ("tags", "software", "description", "title"),
    [
        ([], "", "Aperio Image Library v1\r\n", "Aperio SVS"),
        ([], "", '<?xml version="1.0"?><scn></scn>', "Leica SCN"),
        ([(65420, 3, [1]), (271, 2, "Hamamatsu")], "", "", "Hamamatsu NDPI"),
        ([], "PerkinElmer-QPI", "", "PerkinElmer QPI"),
        ([], "Philips DP v1.0", "<DataObject></DataObject>", "Philips TIFF"),
    ],
)
def test_images_of_whole_slides_are_refused(tmp_path, tags, software, description, title):
    programs.write(tmp_path / "a.tif", VALUES, tags, software, description)
    with pytest.raises(UnsupportedFormatError, match=f"whole slide .{title}"):
        read(tmp_path / "a.tif")


@pytest.mark.parametrize(
    ("tags", "software", "title"),
    [
        ([(4864, 3, [1])], "", "Andor"),
        ([], "EPICS areaDetector", "EPICS"),
        ([], "SI.VERSION_MAJOR = 5", "Scan"),
    ],
)
def test_pages_that_may_be_times_are_told(tmp_path, tags, software, title):
    volume = read(programs.write(tmp_path / "a.tif", VALUES, tags, software), spacing=(1, 1, 1))
    assert codes(volume) == ["W-AXES-MISSING"]
    assert title in volume.sentences[0]
