"""Files outside the input's folder that a header or a link names are read only with --allow-outside."""

import os

import nibabel as nib
import numpy as np
import pytest

from dmc_cli.errors import VolumeError
from tests.volume_io.reading import counting, read

VALUES = counting((3, 4, 5), "<i2")

NRRD = "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nencoding: raw\nendian: little\ndata file: {}\n"
META = "NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementDataFile = {}\n"


@pytest.fixture
def folder(tmp_path):
    """Return a folder for the header, with the values and each slice beside it in another one."""
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir()
    outside.mkdir()
    (outside / "a.raw").write_bytes(VALUES.tobytes())
    for k, plane in enumerate(VALUES):
        (outside / f"s{k}.raw").write_bytes(plane.tobytes())
    return inside


def nrrd(folder, named):
    (folder / "a.nhdr").write_text(NRRD.format(named))
    return folder / "a.nhdr"


def meta(folder, named):
    (folder / "a.mhd").write_text(META.format(named))
    return folder / "a.mhd"


def refused_unless_allowed(path):
    with pytest.raises(
        VolumeError, match=r"outside the header's folder; expected it beside .*--allow-outside"
    ) as caught:
        read(path)
    assert caught.value.exit_status == 3
    np.testing.assert_array_equal(read(path, allow_outside=True).values, VALUES)


NAMED = {
    "climbing": "../out/a.raw",
    "absolute": "{out}/a.raw",
    "pattern": "../out/s%d.raw 0 2 1",
    "list": "LIST\n../out/s0.raw\n../out/s1.raw\n../out/s2.raw",
}


@pytest.mark.parametrize("header", [nrrd, meta])
@pytest.mark.parametrize("named", NAMED)
def test_names_that_lead_out(folder, header, named):
    refused_unless_allowed(header(folder, NAMED[named].format(out=folder.parent / "out")))


@pytest.mark.parametrize("header", [nrrd, meta])
@pytest.mark.parametrize("through", ["file", "folder"])
def test_links_that_lead_out(folder, header, through):
    (folder / "a.raw").symlink_to(folder.parent / "out/a.raw")
    (folder / "deep").symlink_to(folder.parent / "out")
    refused_unless_allowed(header(folder, "a.raw" if through == "file" else "deep/a.raw"))


@pytest.mark.parametrize("header", [nrrd, meta])
@pytest.mark.parametrize("named", ["a.raw", "./a.raw", "deep/a.raw", "deep/../a.raw", "linked.raw"])
def test_whatever_lies_in_the_folder_is_read(folder, header, named):
    (folder / "deep").mkdir()
    for place in ("a.raw", "deep/a.raw"):
        (folder / place).write_bytes(VALUES.tobytes())
    (folder / "linked.raw").symlink_to("deep/a.raw")
    np.testing.assert_array_equal(read(header(folder, named)).values, VALUES)


def test_a_folder_whose_name_begins_like_the_headers_is_another_one(folder):
    other = folder.with_name("in2")
    (folder.parent / "out").rename(other)
    refused_unless_allowed(nrrd(folder, "../in2/a.raw"))


@pytest.mark.parametrize("header", [nrrd, meta])
def test_header_and_data_may_both_be_links_to_another_folder(folder, header):
    """Then the data lie beside the header, wherever that is."""
    out = folder.parent / "out"
    path = header(out, "a.raw")
    (folder / path.name).symlink_to(path)
    (folder / "a.raw").symlink_to(out / "a.raw")
    np.testing.assert_array_equal(read(folder / path.name).values, VALUES)


def test_the_header_alone_may_be_a_link(folder):
    path = nrrd(folder.parent / "out", "a.raw")
    (folder / "a.raw").write_bytes(VALUES.tobytes())
    (folder / "a.nhdr").symlink_to(path)
    np.testing.assert_array_equal(read(folder / "a.nhdr").values, VALUES)


@pytest.mark.parametrize("kind", [nib.Nifti1Pair, nib.Spm2AnalyzeImage])
@pytest.mark.parametrize("given", [".hdr", ".img"])
def test_the_other_file_of_a_pair_may_not_be_a_link_out(folder, kind, given):
    path = folder / "a.img"
    nib.save(kind(VALUES.T, np.diag([2, 3, 4, 1])), path)
    other = folder / ("a.img" if given == ".hdr" else "a.hdr")
    other.rename(folder.parent / "out" / other.name)
    other.symlink_to(folder.parent / "out" / other.name)
    refused_unless_allowed(path.with_suffix(given))


@pytest.mark.parametrize("allowed", [False, True])
@pytest.mark.parametrize("named", ["pipe", "device"])
def test_pipes_and_devices_are_never_opened(folder, named, allowed):
    os.mkfifo(folder / "pipe")
    (folder / "device").symlink_to("/dev/zero")
    for header in (nrrd, meta):
        with pytest.raises(VolumeError):
            read(header(folder, named), allow_outside=allowed)


def test_the_header_of_an_image_may_be_no_pipe(folder):
    (folder / "a.img").write_bytes(VALUES.tobytes())
    os.mkfifo(folder / "a.hdr")
    with pytest.raises(VolumeError, match="not a regular file"):
        read(folder / "a.img")


def test_a_loop_of_links_is_told(folder):
    (folder / "a.nii").symlink_to("b.nii")
    (folder / "b.nii").symlink_to("a.nii")
    with pytest.raises(VolumeError, match="cannot be opened"):
        read(folder / "a.nii")
    (folder / "a.raw").symlink_to("b.raw")
    (folder / "b.raw").symlink_to("a.raw")
    with pytest.raises(VolumeError, match="is not there"):
        read(nrrd(folder, "a.raw"))


@pytest.mark.parametrize("header", [nrrd, meta])
@pytest.mark.parametrize("named", [r"raw\a.raw", r".\raw\a.raw"])
def test_a_path_that_windows_wrote_is_read_with_slashes(tmp_path, header, named):
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "a.raw").write_bytes(VALUES.tobytes())
    np.testing.assert_array_equal(read(header(tmp_path, named)).values, VALUES)


@pytest.mark.parametrize("header", [nrrd, meta])
def test_slices_that_windows_named_are_read_with_slashes(tmp_path, header):
    (tmp_path / "raw").mkdir()
    for k, plane in enumerate(VALUES):
        (tmp_path / "raw" / f"s{k}.raw").write_bytes(plane.tobytes())
    for named in ("raw\\s%d.raw 0 2 1", "LIST\n" + "".join(f"raw\\s{k}.raw\n" for k in range(3))):
        np.testing.assert_array_equal(read(header(tmp_path, named)).values, VALUES)


@pytest.mark.parametrize("header", [nrrd, meta])
def test_a_backslash_that_is_a_name_s_own_stays_one(tmp_path, header):
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "a.raw").write_bytes(bytes(VALUES.nbytes))
    (tmp_path / "raw\\a.raw").write_bytes(VALUES.tobytes())
    np.testing.assert_array_equal(read(header(tmp_path, r"raw\a.raw")).values, VALUES)


@pytest.mark.parametrize("header", [nrrd, meta])
def test_backslashes_lead_out_of_the_folder_no_more_than_slashes(folder, header):
    refused_unless_allowed(header(folder, r"..\out\a.raw"))


@pytest.mark.parametrize("header", [nrrd, meta])
def test_the_file_of_another_disk_is_told_what_to_do(tmp_path, header):
    path = header(tmp_path, r"C:\scans\a.raw")
    with pytest.raises(VolumeError, match=r"is not there; put it beside the header$"):
        read(path)
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    told = "is not there; a file 'a.raw' is beside the header: if it is that one, name it so in the header"
    with pytest.raises(VolumeError, match=told):
        read(path)


@pytest.mark.parametrize("header", [nrrd, meta])
def test_small_and_capital_letters_of_a_data_file_do_not_count(tmp_path, header):
    """Where they do not on the system that wrote the header."""
    (tmp_path / "Scan.RAW").write_bytes(VALUES.tobytes())
    path = header(tmp_path, "scan.raw")
    np.testing.assert_array_equal(read(path).values, VALUES)
    (tmp_path / "SCAN.raw").write_bytes(bytes(VALUES.nbytes))
    if len([*tmp_path.iterdir()]) == 3:  # the system tells them apart
        with pytest.raises(VolumeError, match="is not there"):
            read(path)
