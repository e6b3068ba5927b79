import json

import nibabel
import numpy as np


def test_info_tells_what_a_volume_is(run):
    result = run("info", "synth:sphere:9")
    assert result.exit_code == 0
    assert "9 x 9 x 9 nodes of float32, 0.25 x 0.25 x 0.25 mm, no space" in result.stdout
    assert "-0.982051 to 0.75" in result.stdout
    assert result.stderr == ""


def test_info_as_json_holds_the_same(run):
    description = json.loads(run("info", "synth:sphere:9", "--json").stdout)
    assert description["shape"] == [9, 9, 9]
    assert description["spacing_mm"] == [0.25, 0.25, 0.25]
    assert description["value_range"] == [-0.9820508360862732, 0.75]
    assert description["space"] == "none"
    assert description["series"][0]["size"] == [9, 9, 9]


def test_a_missing_file_ends_with_status_3(run, tmp_path):
    result = run("info", tmp_path / "missing.nii")
    assert result.exit_code == 3
    assert result.stdout == ""
    assert result.stderr.startswith("Error: ")


def test_where_errors_come_from_is_told_on_request(run, tmp_path):
    assert "Traceback" not in run("info", tmp_path / "missing.nii", "-v").stderr
    assert "Traceback" in run("info", tmp_path / "missing.nii", "-vv").stderr


def test_of_several_volumes_in_a_file_the_first_is_described(run, tmp_path):
    values = np.stack([np.full((3, 4, 5), value, np.int16) for value in (7, 8)], axis=-1)
    nibabel.save(nibabel.Nifti1Image(values, np.eye(4)), tmp_path / "two.nii")
    result = run("info", tmp_path / "two.nii")
    assert result.exit_code == 0
    assert "values    7 to 7" in result.stdout
    assert "--volume-index" in result.stdout
    assert "values    8 to 8" in run("info", tmp_path / "two.nii", "--volume-index", 1).stdout


def test_of_several_components_of_a_nrrd_file_the_first_is_described(run, tmp_path):
    header = "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 3 2 2 2\nspacings: nan 1 1 1\nencoding: raw\n"
    header += "kinds: 3-color space space space\n\n"
    (tmp_path / "color.nrrd").write_bytes(header.encode() + bytes([7, 8, 9] * 8))
    result = run("info", tmp_path / "color.nrrd")
    assert result.exit_code == 0
    assert "values    7 to 7" in result.stdout
    assert "--volume-index N, N from 0 to 2; this is volume 0" in result.stdout
    told = json.loads(run("info", tmp_path / "color.nrrd", "--json").stdout)
    assert "W-FIRST-VOLUME" in told["warning_codes"]
    assert "values    8 to 8" in run("info", tmp_path / "color.nrrd", "--volume-index", 1).stdout
    assert run("convert", tmp_path / "color.nrrd", tmp_path / "a.ply", "-i", 1).exit_code == 4


def test_the_series_of_a_folder_are_listed_and_chosen(run, sample_data, tmp_path):
    slices = sorted((sample_data / "dicom" / "head_ct").iterdir())[:6]
    for number, path in enumerate(slices):
        copy_series(path, tmp_path / path.name, number // 3)
    listing = run("info", tmp_path)
    assert listing.exit_code == 0
    assert "choose one with --series" in listing.stdout
    ambiguous = run("convert", tmp_path, tmp_path / "mesh.ply", "-i", 300)
    assert ambiguous.exit_code == 4
    assert "--series" in ambiguous.stderr
    assert run("convert", tmp_path, tmp_path / "mesh.ply", "-i", 300, "--series", 2).exit_code == 0
    chosen = run("info", tmp_path, "--series", 2)
    assert chosen.exit_code == 0
    assert "choose one" not in chosen.stdout


def copy_series(source, target, number):
    """Copy a slice into the series of this number."""
    import pydicom

    dataset = pydicom.dcmread(source)
    dataset.SeriesInstanceUID = f"{dataset.SeriesInstanceUID}.{number}"[-64:].strip(".")
    dataset.save_as(target)
