import numpy as np
import pytest

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume


@pytest.mark.parametrize("name", ["a.nii", "a.nii.gz", "a.nrrd", "a.mha"])
def test_synth_writes_a_volume(run, tmp_path, name):
    assert run("synth", "noise", tmp_path / name, "-n", 7, "--seed", 5, "--sigma", 1).exit_code == 0
    values = read_volume(str(tmp_path / name), ReadSettings()).values
    expected = read_volume("synth:noise:7", ReadSettings(seed=5, sigma=1.0)).values
    np.testing.assert_array_equal(values, expected)


def test_an_existing_volume_needs_force(run, tmp_path):
    path = tmp_path / "a.nrrd"
    path.write_bytes(b"old")
    result = run("synth", "iwp", path, "-n", 4)
    assert (result.exit_code, path.read_bytes()) == (9, b"old")
    assert "--force" in result.stderr
    assert run("synth", "iwp", path, "-n", 4, "--force").exit_code == 0
    assert path.read_bytes().startswith(b"NRRD0005")


def test_quiet_says_nothing(run, tmp_path):
    result = run("synth", "iwp", tmp_path / "a.nrrd", "-n", 4, "--quiet")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")


def test_standard_output_needs_a_format_and_carries_only_data(run):
    assert run("synth", "iwp", "-", "-n", 4).exit_code == 2
    result = run("synth", "iwp", "-", "-n", 4, "--output-format", "raw")
    assert result.exit_code == 0
    assert len(result.stdout_bytes) == 4**3 * 4


def test_the_output_is_looked_at_before_the_work(run, tmp_path):
    result = run("synth", "iwp", tmp_path / "missing" / "a.nrrd", "-n", 20_000)
    assert result.exit_code == 9
    assert run("synth", "iwp", tmp_path / "a.xyz", "-n", 20_000).exit_code == 2


def test_what_was_written_is_told(run, tmp_path):
    path = tmp_path / "a.nrrd"
    assert run("synth", "sphere", path, "-n", 9).stderr == f"{path}: 9^3 nodes, values -0.982051 to 0.75\n"
