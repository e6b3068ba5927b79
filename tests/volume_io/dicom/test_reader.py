"""Folders, zips and single files: which of their images are slices, and what is said of others."""

import os
import warnings
import zipfile

import numpy as np
import pytest
from pydicom import uid

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import STACK, axial, make_slice, save, save_stack
from tests.volume_io.reading import read


def test_other_files_in_the_folder_are_passed_over(tmp_path):
    save_stack(tmp_path, axial())
    (tmp_path / "notes.txt").write_text("nothing of the kind")
    (tmp_path / "empty").touch()
    (tmp_path / "broken").write_bytes(b"\x08\x00\x05\x00CS\x0a\x00ISO")
    save(make_slice((0, 0, 0), 0, PixelData=b"", Rows=None), tmp_path / "report")
    np.testing.assert_array_equal(read(tmp_path).values, STACK)


def test_files_in_subfolders_and_links_that_loop(tmp_path):
    save_stack(tmp_path / "a" / "b", axial())
    os.symlink(tmp_path, tmp_path / "a" / "loop")
    os.symlink(tmp_path / "a" / "b", tmp_path / "again")
    np.testing.assert_array_equal(read(tmp_path).values, STACK)


def two_series(folder):
    save_stack(folder / "one", axial(), series="1.2.7")
    save_stack(folder / "two", axial(5, 3), series="1.2.9")
    return folder


def test_two_series_are_listed_with_the_option_that_chooses(tmp_path):
    with pytest.raises(
        AmbiguousVolumeError, match=r"(?s)2 series.*--series N:\n  --series 1: CT.*--series 2.*1\.2\.9"
    ) as caught:
        read(two_series(tmp_path))
    assert caught.value.exit_status == 4
    first, second = list_volumes(str(tmp_path), ReadSettings())
    assert (first.number, first.uid, first.modality, first.size) == (1, "1.2.7", "CT", (5, 4, 4))
    assert (second.number, second.description, second.slices) == (2, "series 1.2.9", 5)


def test_a_series_is_chosen_by_number_or_uid(tmp_path):
    two_series(tmp_path)
    assert read(tmp_path, series="2").shape == read(tmp_path, series="1.2.9").shape == (5, 4, 5)
    assert read(tmp_path, series="1").shape == (5, 4, 4)
    with pytest.raises(SettingsError, match=r"(?s)series is '3'.*--series 1"):
        read(tmp_path, series="3")


def test_single_images_and_localizers_are_dropped(tmp_path):
    save_stack(tmp_path / "ct", axial())
    save(make_slice((0, 0, 0), 0, orientation=(0, 1, 0, 0, 0, -1)), tmp_path / "scout")
    save_stack(tmp_path / "loc", axial(3, 50), series="1.2.1", ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    np.testing.assert_array_equal(read(tmp_path).values, STACK)


def test_orientations_of_one_series_are_stacks_to_choose_from(tmp_path):
    save_stack(tmp_path / "axial", axial())
    sagittal = [(30.0 + k, 0, 0) for k in range(3)]
    save_stack(tmp_path / "sagittal", sagittal, orientation=(0, 1, 0, 0, 0, -1))
    with pytest.raises(AmbiguousVolumeError, match="2 series"):
        read(tmp_path)
    assert {read(tmp_path, series=n).shape[2] for n in "12"} == {3, 4}


@pytest.mark.parametrize("packing", [zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_BZIP2])
def test_a_zip_is_read_without_unpacking(tmp_path, packing):
    save_stack(tmp_path / "in", axial())
    with zipfile.ZipFile(tmp_path / "scan.zip", "w", packing) as archive:
        for path in (tmp_path / "in").iterdir():
            archive.write(path, f"scan/{path.name}")
        archive.writestr("readme.txt", "nothing")
    volume = read(tmp_path / "scan.zip")
    np.testing.assert_array_equal(volume.values, STACK)
    assert volume.files == (tmp_path / "scan.zip",)


def test_a_zip_entry_that_claims_too_much_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a", b"tiny")
    content = (tmp_path / "bomb.zip").read_bytes()
    claim = (4).to_bytes(4, "little")
    (tmp_path / "bomb.zip").write_bytes(content.replace(claim + b"\x01\0", b"\xff\xff\xff\x7f" + b"\x01\0"))
    with pytest.raises(VolumeError) as caught:
        read(tmp_path / "bomb.zip")
    assert caught.value.exit_status == 3


def test_a_dicomdir_stands_for_its_folder(tmp_path):
    save_stack(tmp_path / "IMAGES", axial())
    (tmp_path / "DICOMDIR").write_bytes(bytes(128) + b"DICM")
    np.testing.assert_array_equal(read(tmp_path / "DICOMDIR").values, STACK)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda folder: None, "no DICOM image found"),
        (lambda folder: (folder / "notes").write_text("x" * 200), "no DICOM image found"),
        (lambda folder: save(make_slice((0, 0, 0), 0), folder / "a"), "no two slices of one volume"),
        (
            lambda folder: save(make_slice((0, 0, 0), 0, ImagePositionPatient=None), folder / "a"),
            "no position",
        ),
        (lambda folder: save_stack(folder, axial(), SamplesPerPixel=3), "colour"),
        (lambda folder: save_stack(folder, axial(), PixelSpacing=[0, 0]), "positive lengths"),
        (lambda folder: save_stack(folder, axial(), orientation=(1, 0, 0, 1, 0, 0)), "perpendicular"),
        (lambda folder: save_stack(folder, axial(), orientation=(1, 0, 0, 0, 1)), "6 finite numbers"),
    ],
)
def test_folders_without_a_volume_tell_what_they_hold(tmp_path, make, told):
    make(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(VolumeError, match=told) as caught:
            read(tmp_path)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize("lost", [1, 30])
def test_a_truncated_slice_is_refused(tmp_path, lost):
    save_stack(tmp_path, axial(), names="abcd")
    content = (tmp_path / "c").read_bytes()
    (tmp_path / "c").write_bytes(content[:-lost])
    with pytest.raises(DamagedVolumeError, match=r"c: .*bytes of pixel data found"):
        read(tmp_path)


def test_an_absurd_size_is_not_trusted(tmp_path):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k)
        dataset.compress(uid.RLELossless)
        dataset.Rows = dataset.Columns = 65535
        save(dataset, tmp_path / f"{k}")
    with pytest.raises(DamagedVolumeError, match="header is damaged"):
        read(tmp_path)


@pytest.mark.parametrize("kept", [200, 400])
def test_a_missing_slice_whose_file_is_cut_short_is_told_with_it(tmp_path, kept):
    for k, position in enumerate(axial(6)):
        path = save(make_slice(position, k), tmp_path / f"IM{k}")
        if k == 3:
            path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(AmbiguousVolumeError, match=r"missing slice found.*; 1 file\(s\) left out: IM3: "):
        read(tmp_path)
