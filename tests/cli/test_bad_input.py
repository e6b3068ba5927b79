"""Bad input: one message, the right status, no output, an older output untouched."""

import numpy as np
import pytest

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.volume_file import write_volume


def missing(folder):
    return folder / "missing.nii"


def empty(folder):
    (folder / "empty.nii.gz").touch()
    return folder / "empty.nii.gz"


def truncated(suffix):
    def make(folder):
        path = folder / f"cut{suffix}"
        write_volume(str(path), read_volume("synth:noise:12", ReadSettings()))
        path.write_bytes(path.read_bytes()[:-1000])
        return path

    make.__name__ = f"truncated{suffix}"
    return make


def without_images(folder):
    (folder / "scans").mkdir()
    (folder / "scans" / "notes.txt").write_text("no image")
    return folder / "scans"


def with_values(values, name):
    def make(folder):
        path = folder / "values.nii"
        volume = read_volume("synth:sphere:4", ReadSettings())
        object.__setattr__(volume, "values", np.broadcast_to(values, (4, 4, 4)).astype(np.float32))
        write_volume(str(path), volume)
        return path

    make.__name__ = name
    return make


CASES = [
    (missing, 3, "missing.nii"),
    (empty, 3, "empty"),
    (truncated(".nii"), 3, "bytes"),
    (truncated(".nii.gz"), 3, "cut.nii.gz"),
    (truncated(".nrrd"), 3, "bytes"),
    (truncated(".mha"), 3, "bytes"),
    (without_images, 3, "scans"),
    (with_values(np.float32(3), "constant"), 5, "3"),
    (with_values(np.float32("nan"), "without_a_finite_value"), 3, "finite"),
]


@pytest.mark.parametrize(("make", "status", "word"), CASES, ids=[case[0].__name__ for case in CASES])
def test_bad_input(run, tmp_path, make, status, word):
    output = tmp_path / "out" / "old.ply"
    output.parent.mkdir()
    output.write_bytes(b"old")
    result = run("convert", make(tmp_path), output, "-i", "0.5", "--force")
    assert result.exit_code == status, result.stderr
    assert word in result.stderr
    assert result.stderr.startswith("Error: ")
    assert result.stdout == ""
    assert output.read_bytes() == b"old"
    assert [path.name for path in output.parent.iterdir()] == ["old.ply"]


def test_raw_of_the_wrong_size_names_both_sizes(run, tmp_path):
    path = tmp_path / "head.raw"
    path.write_bytes(bytes(1000))
    result = run("convert", path, tmp_path / "out.ply", "-i", 0, "--shape", "10,10,11", "--dtype", "uint8")
    assert result.exit_code == 3
    assert "1000" in result.stderr
    assert "1100" in result.stderr


def test_raw_without_a_shape_names_the_options(run, tmp_path):
    path = tmp_path / "head.raw"
    path.write_bytes(bytes(1000))
    result = run("convert", path, tmp_path / "out.ply", "-i", 0)
    assert result.exit_code in (2, 3)
    assert "--shape" in result.stderr


def test_a_volume_thinner_than_two_nodes_is_refused(run, tmp_path):
    path = tmp_path / "head.raw"
    path.write_bytes(bytes(100))
    result = run("convert", path, tmp_path / "out.ply", "-i", 0, "--shape", "10,10,1", "--dtype", "uint8")
    assert result.exit_code == 3
    assert "at least two along each axis" in result.stderr


def test_data_outside_the_folder_of_the_header_need_an_option(run, tmp_path):
    write_volume(str(tmp_path / "ball.raw"), read_volume("synth:sphere:12", ReadSettings()))
    header = tmp_path / "in" / "ball.nhdr"
    header.parent.mkdir()
    fields = "type: float\ndimension: 3\nsizes: 12 12 12\nencoding: raw\nendian: little\n"
    header.write_text(f"NRRD0004\n{fields}data file: ../ball.raw\n")
    output = tmp_path / "ball.ply"
    result = run("convert", header, output, "-i", 0)
    assert result.exit_code == 3
    assert "lies outside the header's folder" in result.stderr
    assert "--allow-outside" in result.stderr
    assert not output.exists()
    assert run("convert", header, output, "-i", 0, "--allow-outside").exit_code == 0
    assert output.exists()
