"""`--placement`: what the report says of each, and what `--require on-surface` makes of it."""

import json

import pytest

from dmc_cli.report.requirements import ON_SURFACE


def report_of(run, tmp_path, placement, *more):
    path = tmp_path / "report.json"
    result = run(
        "convert",
        "synth:iwp:32",
        tmp_path / "iwp.ply",
        "-i",
        0,
        "--placement",
        placement,
        "--report",
        path,
        *more,
    )
    return result, json.loads(path.read_text())


@pytest.mark.parametrize("placement", ["exact", "sampled"])
def test_vertices_on_the_surface_are_accepted(run, tmp_path, placement):
    result, report = report_of(run, tmp_path, placement, "--require", "on-surface", "--check")
    assert result.exit_code == 0
    assert report["settings"]["placement"] == placement
    assert report["deviation"]["max_relative"] <= ON_SURFACE
    assert report["surface"]["fallback_vertices"] == 0


@pytest.mark.parametrize("placement", ["iterative", "centroid"])
def test_vertices_off_the_surface_are_refused_and_the_deviation_told(run, tmp_path, placement):
    result, report = report_of(run, tmp_path, placement, "--require", "on-surface")
    assert result.exit_code == 6
    assert "--placement exact" in result.stderr
    assert report["deviation"]["max_relative"] > ON_SURFACE
    assert not (tmp_path / "iwp.ply").exists()


@pytest.mark.parametrize("placement", ["iterative", "centroid"])
def test_a_check_does_not_ask_of_a_placement_what_it_cannot_do(run, tmp_path, placement):
    result, _ = report_of(run, tmp_path, placement, "--check")
    assert result.exit_code == 0


def test_an_unknown_placement_is_refused(run, tmp_path):
    result = run("convert", "synth:iwp:32", tmp_path / "iwp.ply", "-i", 0, "--placement", "guessed")
    assert result.exit_code == 2
    assert "'exact', 'sampled', 'iterative', 'centroid'" in result.stderr
