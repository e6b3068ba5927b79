"""What Philips keeps in elements of its own: a sequence of each frame, and a scale of values."""

import numpy as np
import pytest
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.volume_io.dicom.makers import PHILIPS, PHILIPS_FRAMES
from tests.volume_io.dicom.scanner import axial, make_slice, save
from tests.volume_io.dicom.test_frames import enhanced
from tests.volume_io.dicom.test_kinds import told, words
from tests.volume_io.reading import physical, read

SYNTAXES = [ExplicitVRLittleEndian, ImplicitVRLittleEndian]


def add_scale(dataset, slope, intercept, block=0x10):
    dataset.add_new(0x20050000 | block, "LO", PHILIPS)
    dataset.add_new(0x2005000D | block << 8, "FL", intercept)
    dataset.add_new(0x2005000E | block << 8, "FL", slope)


def with_own_elements(heights, fill, syntax):
    """An enhanced image in whose groups are items that `fill` has filled, by the number of the frame."""
    dataset, values = enhanced(heights, syntax=syntax)
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        item = Dataset()
        fill(item, n)
        group.add_new(0x20050014, "LO", PHILIPS_FRAMES)
        group.add_new(0x2005140F, "SQ", Sequence([item]))
    return dataset, values


@pytest.mark.parametrize("syntax", SYNTAXES)
@pytest.mark.parametrize(
    ("tag", "creator", "vr", "pair", "expected"),
    [
        (0x20011003, "Philips Imaging DD 001", "FL", (700.0, 0.0), ["b-value 0 s/mm2", "b-value 700 s/mm2"]),
        (0x200510B0, PHILIPS, "FL", (1.0, 0.5), ["gradient x 0.5", "gradient x 1"]),
        (0x20051429, PHILIPS_FRAMES, "CS", ("LABEL", "CONTROL"), None),
        (0x20051413, PHILIPS_FRAMES, "IS", ("10", "9"), ["gradient number 9", "gradient number 10"]),
        (0x00181060, None, "DS", ("90", "45"), ["trigger time 45 ms", "trigger time 90 ms"]),
        (0x00089208, None, "CS", ("PHASE", "MAGNITUDE"), None),
    ],
)
def test_own_elements_of_frames_tell_them_apart(tmp_path, tag, creator, vr, pair, expected, syntax):
    def fill(item, n):
        if creator:
            item.add_new(tag >> 16 << 16 | tag >> 8 & 0xFF, "LO", creator)
        item.add_new(tag, vr, pair[n // 3])

    dataset, values = with_own_elements([0, 2, 4, 0, 2, 4], fill, syntax)
    path = save(dataset, tmp_path / "a")
    names = {"CS": "spin labelling" if creator else "complex component"}
    assert words(path) == (expected or [f"{names[vr]} {value}" for value in sorted(pair)])
    np.testing.assert_array_equal(read(path, series="1").values, values[3:])


@pytest.mark.parametrize("syntax", SYNTAXES)
@pytest.mark.parametrize("block", [0x10, 0x12])
def test_a_scale_of_single_images_is_told(tmp_path, syntax, block):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, syntax=syntax, RescaleSlope="2", RescaleIntercept="0")
        add_scale(dataset, 0.25, 0.0, block)
        save(dataset, tmp_path / str(k))
    volume = read(tmp_path)
    assert volume.slope == 2
    assert "floating-point values are (stored value - 0) / 0.25;" in told(volume)["W-VALUES-MAPPED"]


def test_a_scale_that_is_the_standards_is_not_told(tmp_path):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, RescaleSlope="2", RescaleIntercept="-8")
        add_scale(dataset, 0.5, 4.0)
        save(dataset, tmp_path / str(k))
    assert told(read(tmp_path)) == {}


@pytest.mark.parametrize("syntax", SYNTAXES)
def test_scales_of_frames_are_told(tmp_path, syntax):
    dataset, values = with_own_elements(
        [0, 2, 4], lambda item, n: add_scale(item, 0.25 + n // 2, -3.0), syntax
    )
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(physical(volume), values - 1024.0)
    assert (
        "/ 0.25, and 1 other scale(s) in other slices; it is not applied" in told(volume)["W-VALUES-MAPPED"]
    )
