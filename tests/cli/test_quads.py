"""`--quads` on the command line."""

import json

import pytest

SYNTH = ("convert", "synth:genus_two:32")


def test_the_report_and_the_summary_say_what_was_reached(run, tmp_path):
    path = tmp_path / "report.json"
    result = run(*SYNTH, tmp_path / "mesh.ply", "-i", 0, "--quads", "25%", "--report", path, "--check")
    assert result.exit_code == 0
    report = json.loads(path.read_text())
    size = report["size"]
    assert size["quads"] == size["quads_wanted"] == round(size["quads_before"] / 4) == report["mesh"]["quads"]
    assert size["reached"]
    assert size["stopped_by"] is None
    assert report["timings_ms"]["size"] > 0
    assert f"size      {size['quads']} of {size['quads_before']} quads" in result.stderr


def test_what_stopped_it_is_told(run, tmp_path):
    path = tmp_path / "report.json"
    result = run("convert", "synth:sphere:8", tmp_path / "a.ply", "-i", 0, "--quads", 1, "--report", path)
    assert result.exit_code == 0
    report = json.loads(path.read_text())
    assert not report["size"]["reached"]
    assert report["size"]["stopped_by"] in ("topology", "shape", "distance", "fixed")
    assert report["warning_codes"] == ["W-QUADS-LEFT"]
    assert f"{report['size']['quads']} quads are left of the 1 that were asked for" in result.stderr


def test_a_number_above_the_count_is_told(run, tmp_path):
    path = tmp_path / "report.json"
    words = ("convert", "synth:sphere:8", tmp_path / "a.ply", "-i", 0, "--quads", 100_000)
    result = run(*words, "--report", path)
    assert result.exit_code == 0
    assert json.loads(path.read_text())["warning_codes"] == ["W-QUADS-FEWER"]
    told = " ".join(result.stderr.split())
    assert "no more than the 100000 that were asked for; none were taken away (W-QUADS-FEWER)" in told


@pytest.mark.parametrize("given", ["0", "-3", "0%", "100%", "many", "1.5", "nan%", "inf%", "", "%"])
def test_what_is_no_number_of_quads_is_refused(run, tmp_path, given):
    result = run(*SYNTH, tmp_path / "a.ply", "-i", 0, f"--quads={given}")
    assert result.exit_code == 2
    assert "expected a number of quads from 1 on, or a share under 100 %" in " ".join(result.stderr.split())
    assert not (tmp_path / "a.ply").exists()


@pytest.mark.parametrize("words", [("--simplify-rules", "paper"), ("--no-project",)])
def test_the_papers_rules_do_not_go_with_a_size(run, tmp_path, words):
    result = run(*SYNTH, tmp_path / "a.ply", "-i", 0, "--quads", 100, "--simplify", "all", *words)
    assert result.exit_code == 2
    assert "quads is '100', but " in result.stderr


def test_a_dump_of_what_is_left_passes_the_checks(run, tmp_path):
    words = ("-i", 0, "--quads", 300, "--relax", 2, "--halfedges", tmp_path / "dump.npz", "--check")
    assert run(*SYNTH, tmp_path / "mesh.ply", *words).exit_code == 0
