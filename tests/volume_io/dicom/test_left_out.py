"""Files and images that are left out of a volume are named: none of them disappears silently."""

import re

import numpy as np
import pytest
from pydicom import uid

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError
from tests.volume_io.dicom.scanner import axial, make_slice, save, save_stack
from tests.volume_io.reading import read

TILTED = (1, 0, 0, 0, float(np.cos(np.radians(0.8))), float(np.sin(np.radians(0.8))))


def save_named(folder, count=6, others=(), **elements):
    """Slices IM0, IM1, ...; those whose numbers are in `others` with further elements."""
    for k, position in enumerate(axial(count)):
        save(make_slice(position, k, **(elements if k in others else {})), folder / f"IM{k}")
    return folder


def cut(path, kept):
    path.write_bytes(path.read_bytes()[:kept])


@pytest.mark.parametrize("syntax", [uid.ImplicitVRLittleEndian, uid.ExplicitVRLittleEndian])
def test_a_slice_cut_anywhere_in_its_header_is_told(tmp_path, syntax):
    for k, position in enumerate(axial(3)):
        path = save(make_slice(position, k, syntax=syntax), tmp_path / f"IM{k}")
    content = path.read_bytes()
    for kept in range(132, content.index(b"\xe0\x7f\x10\x00") + 9, 7):
        path.write_bytes(content[:kept])
        volume = read(tmp_path)
        assert volume.shape[2] == 2
        (warning,) = volume.sentences
        assert warning.startswith("a file was left out: IM2: "), kept
        assert [notice.code for notice in volume.warnings] == ["W-FILE-DAMAGED"]


@pytest.mark.parametrize("kept", [600, 800])
def test_a_deflated_slice_cut_in_its_header_is_told(tmp_path, kept):
    for k, position in enumerate(axial(3)):
        path = save(make_slice(position, k, syntax=uid.DeflatedExplicitVRLittleEndian), tmp_path / f"IM{k}")
    size = len(path.read_bytes())
    cut(path, size * kept // 1000)
    assert read(tmp_path).sentences == (
        "a file was left out: IM2: the file ends before its pixel data; get the file again",
    )


def test_a_slice_without_preamble_that_ends_before_its_pixels_is_told(tmp_path):
    for k, position in enumerate(axial(3)):
        path = save(make_slice(position, k), tmp_path / f"IM{k}")
    content = path.read_bytes()
    begin = content.index(b"\x08\x00\x08\x00CS")
    path.write_bytes(content[begin : content.index(b"\x28\x00\x10\x00")])
    assert "IM2: the file ends before its pixel data" in read(tmp_path).sentences[0]


def test_an_image_without_pixel_data_is_told_and_a_report_is_not(tmp_path):
    save_named(tmp_path, 3)
    image = make_slice((0, 0, 0), 0)
    del image.PixelData
    save(image, tmp_path / "image")
    report = make_slice((0, 0, 0), 0, SOPClassUID=uid.BasicTextSRStorage)
    report.file_meta.MediaStorageSOPClassUID = uid.BasicTextSRStorage
    del report.PixelData
    save(report, tmp_path / "report")
    (tmp_path / "empty").touch()
    (tmp_path / "junk").write_bytes(b"junk" * 100)
    assert read(tmp_path).sentences == (
        "a file was left out: image: the file ends before its pixel data; get the file again",
    )


@pytest.mark.parametrize(
    ("count", "rest"),
    [(3, []), (4, ["and 1 more damaged file was left out"]), (6, ["and 3 more damaged files were left out"])],
)
def test_of_many_damaged_files_the_rest_is_counted(tmp_path, count, rest):
    save_named(tmp_path, 2 + count)
    for k in range(2, 2 + count):
        cut(tmp_path / f"IM{k}", 400)
    warnings = read(tmp_path).sentences
    assert [re.search(r"IM\d|and .*", warning)[0] for warning in warnings] == ["IM2", "IM3", "IM4", *rest]


def test_a_lone_file_that_ends_before_its_pixels_is_damaged(tmp_path):
    path = save_named(tmp_path, 1) / "IM0"
    cut(path, 400)
    with pytest.raises(DamagedVolumeError, match="IM0: the file ends before its pixel data"):
        read(path)


@pytest.mark.parametrize(
    "elements", [{"orientation": TILTED}, {"PixelSpacing": [0.5, 0.8]}, {"Rows": 2, "Columns": 10}]
)
def test_an_image_of_another_geometry_is_told(tmp_path, elements):
    volume = read(save_named(tmp_path, others=[5], **elements))
    assert volume.shape[2] == 5
    assert volume.sentences == ("1 image of another orientation, spacing, size or type was left out: IM5",)


def test_localizers_and_single_images_are_told(tmp_path):
    save_stack(tmp_path / "ct", axial())
    save_stack(
        tmp_path / "loc",
        axial(5, 50),
        "abcde",
        series="1.2.1",
        ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"],
    )
    save(make_slice((0, 0, 0), 0, series="1.2.2"), tmp_path / "single")
    told = (
        "5 localizers were left out: loc/a, loc/b, loc/c and 2 more",
        "1 image of a series without a volume was left out: single",
    )
    assert read(tmp_path).sentences == told
    save_stack(tmp_path / "other", axial(), series="1.2.9")
    assert read(tmp_path, series="1.2.9").sentences == ()


def test_a_localizer_among_the_slices_of_its_series_is_told(tmp_path):
    save_stack(tmp_path, axial(), "abcd")
    save(make_slice((10, 20, 33), 9, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"]), tmp_path / "scout")
    volume = read(tmp_path)
    assert (volume.shape[2], volume.sentences) == (4, ("1 localizer was left out: scout",))


def test_a_missing_slice_that_was_put_aside_is_told_with_it(tmp_path):
    save_named(tmp_path, others=[3], orientation=TILTED)
    with pytest.raises(AmbiguousVolumeError, match=r"1 missing slice found.*; 1 image of another .*: IM3$"):
        read(tmp_path)
