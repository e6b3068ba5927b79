"""`--remesh` on the command line."""

import json


def test_remeshing_reports_its_rounds_and_passes_the_checks(run, tmp_path):
    path = tmp_path / "report.json"
    words = ("-i", 0, "--remesh", 10, "--report", path, "--check")
    result = run(
        "convert", "synth:genus_two:48", tmp_path / "mesh.ply", *words, "--require", "manifold,on-surface"
    )
    assert result.exit_code == 0
    report = json.loads(path.read_text())
    found = report["simplification"]
    assert found["rounds"] == 10
    assert found["operations"] > 0
    assert found["irregular_percent_after"] < found["irregular_percent_patterns"]
    assert found["irregular_percent_after"] == report["topology"]["irregular_percent"]
    assert report["timings_ms"]["remesh"] > 0


def test_remeshing_writes_a_halfedge_dump(run, tmp_path):
    words = ("-i", 0, "--remesh", 3, "--halfedges", tmp_path / "dump.npz", "--check")
    assert run("convert", "synth:genus_two:32", tmp_path / "mesh.ply", *words).exit_code == 0


def test_the_papers_rules_do_not_go_with_remeshing(run, tmp_path):
    words = ("-i", 0, "--remesh", 20, "--simplify-rules", "paper")
    result = run("convert", "synth:genus_two:32", tmp_path / "mesh.ply", *words)
    assert result.exit_code == 2
    assert "remesh is 20, but simplify_rules is 'paper'" in result.stderr
