import json


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
