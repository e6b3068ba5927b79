import gzip
import io
import os
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, SettingsError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_formats import FORMATS
from dmc_cli.volume_io.content import format_of_content
from dmc_cli.volume_io.read import list_volumes
from dmc_cli.volume_io.volume_file import write_volume
from tests.volume_io.nrrd.test_reader import header as nrrd_header
from tests.volume_io.reading import counting, read
from tests.volume_io.test_metaimage import header as meta_header

VALUES = counting((4, 3, 2))
NRRD = nrrd_header().encode() + b"\n" + VALUES.tobytes()


def test_a_missing_file_is_named():
    with pytest.raises(VolumeError, match=r"nowhere\.nii: cannot be opened.*check the path") as caught:
        read("nowhere.nii")
    assert caught.value.exit_status == 3


def test_a_single_volume_is_told_as_one(tmp_path):
    np.save(tmp_path / "a.npy", np.stack([VALUES]))
    with pytest.raises(SettingsError, match=r"a\.npy holds 1 volume; expected 0, or none"):
        read(tmp_path / "a.npy", volume_index=3)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha", ".raw", ""])
def test_an_empty_file_is_refused(tmp_path, suffix):
    (tmp_path / f"a{suffix}").touch()
    with pytest.raises(DamagedVolumeError, match="empty"):
        read(tmp_path / f"a{suffix}", shape=(2, 2, 2), dtype="uint8")


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.nrrd")
    with pytest.raises(VolumeError, match="regular file"):
        read(tmp_path / "a.nrrd")


def test_the_content_decides_where_the_suffix_does_not(tmp_path):
    (tmp_path / "scan").write_bytes(NRRD)
    (tmp_path / "scan.meta").write_bytes(meta_header().encode() + VALUES.tobytes())
    assert read(tmp_path / "scan").format == "nrrd"
    assert read(tmp_path / "scan.meta").format == "meta"


@pytest.mark.parametrize("pack", [bytes, gzip.compress])
def test_the_content_is_looked_at_for_four_kilobytes(tmp_path, pack):
    header = meta_header().encode()
    comment = b"Comment = " + b"c" * (4096 - len(b"Comment = ") - len(b"\nNDimsDimSize"))
    content = comment + b"\nNDimsDimSize" + header
    assert content[:4096].endswith(b"DimSize")
    (tmp_path / "a").write_bytes(pack(content))
    assert format_of_content(tmp_path / "a", "a") == "meta"
    (tmp_path / "a").write_bytes(pack(b"c" + content))
    assert format_of_content(tmp_path / "a", "a") is None


def test_an_unknown_file_tells_what_is_known(tmp_path):
    (tmp_path / "a.xyz").write_bytes(b"some text")
    with pytest.raises(UnsupportedFormatError, match=r"\.nrrd.*--input-format"):
        read(tmp_path / "a.xyz")


def test_input_format_comes_before_the_suffix(tmp_path):
    (tmp_path / "a.raw").write_bytes(NRRD)
    np.testing.assert_array_equal(read(tmp_path / "a.raw", input_format="nrrd").values, VALUES)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"spacing": (2, 2, 2)}, "--spacing has no effect: the file tells its own"),
        ({"origin": (0, 0, 0)}, "--origin has no effect: the file tells its own"),
        ({"series": "3"}, "--series has no effect on nifti input; it is for dicom"),
        ({"slice_gaps": "keep"}, "--slice-gaps has no effect on nifti input; it is for dicom, images, tiff"),
        ({"duplicates": "first"}, "--duplicates has no effect on nifti input; it is for dicom"),
        ({"shape": (4, 4, 4)}, "--shape has no effect on nifti input; it is for raw"),
        ({"dtype": "int8"}, "--dtype has no effect on nifti input; it is for raw"),
        ({"byte_order": "big"}, "--byte-order has no effect on nifti input; it is for raw"),
        ({"skip_bytes": 3}, "--skip-bytes has no effect on nifti input; it is for raw"),
        ({"volume_index": 0}, None),
        ({"byte_order": "little"}, None),
    ],
)
def test_an_option_without_effect_is_told(tmp_path, settings, told):
    path = tmp_path / "a.nii"
    write_volume(str(path), read("synth:noise:4"))
    plain, given = read(path), read(path, **settings)
    assert given.sentences == ((told,) if told else ()) + plain.sentences
    np.testing.assert_array_equal(given.affine, plain.affine)


@pytest.mark.parametrize(
    ("path", "settings", "told"),
    [
        ("synth:torus:4", {"spacing": (2, 2, 2)}, "--spacing has no effect: the field tells its own"),
        ("synth:torus:4", {"volume_index": 1}, "--volume-index has no effect on synthetic input"),
        ("sample_data/dicom/head_ct", {"shape": (4, 4, 4)}, "--shape has no effect on dicom input"),
        ("sample_data/dicom/head_ct", {"skip_bytes": 4}, "--skip-bytes has no effect on dicom input"),
    ],
)
def test_an_option_without_effect_is_told_of_folders_and_fields_too(monkeypatch, path, settings, told):
    monkeypatch.chdir(Path(__file__).parents[2])
    assert read(path, **settings).sentences[0].startswith(told)


def test_every_option_of_reading_has_its_formats():
    elsewhere = {"input_format", "seed", "sigma", "strict", "threads"}
    of_formats = {option for known in FORMATS.values() for option in known.options}
    assert of_formats | elsewhere == {field.name for field in fields(ReadSettings)}
    assert not of_formats & elsewhere


def test_standard_input(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(NRRD)))
    volume = read("-", input_format="nrrd")
    np.testing.assert_array_equal(volume.values, VALUES)
    assert (volume.path, volume.files) == ("-", ())


def test_empty_standard_input_is_refused(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"")))
    with pytest.raises(DamagedVolumeError, match="-: the file is empty"):
        read("-", input_format="nrrd")


def test_a_file_is_one_entry(tmp_path):
    (tmp_path / "a.nrrd").write_bytes(NRRD)
    (entry,) = list_volumes(str(tmp_path / "a.nrrd"), ReadSettings())
    assert (entry.number, entry.size, entry.slices) == (1, (2, 3, 4), 4)
    (entry,) = list_volumes("synth:iwp:8", ReadSettings())
    assert entry.size == (8, 8, 8)


def test_files_of_several_volumes_are_listed_without_a_choice(tmp_path):
    text = nrrd_header(sizes="2 3 4 5", extra="kinds: domain domain domain time\n").encode() + b"\n"
    (tmp_path / "a.nrrd").write_bytes(text + bytes(240))
    (entry,) = list_volumes(str(tmp_path / "a.nrrd"), ReadSettings())
    assert "5 volumes" in entry.description


@pytest.mark.parametrize("name", ["x" * 5000, "x" * 300 + ".nii", "a\0b", "", "x" * 300 + ".hdr"])
@pytest.mark.parametrize(
    "chosen", [None, "dicom", "nrrd", "zarr", "tiff", "numpy", "nifti", "analyze", "meta"]
)
def test_a_path_that_no_system_takes_is_refused(name, chosen):
    with pytest.raises(VolumeError) as caught:
        read(name, input_format=chosen)
    assert caught.value.exit_status == 3
