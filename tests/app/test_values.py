"""Values of vertices and faces in the file: what the report sums up, item by item."""

import json
from collections import Counter

import numpy as np
import pytest

from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.settings import FACE_VALUES

NOISE = ("convert", "synth:noise:14", "--sigma", 1, "-i", 0)
ALL = "quality,deviation,valence,thickness"


@pytest.mark.parametrize("suffix", ["ply", "vtp", "vtu", "vtk"])
@pytest.mark.parametrize(
    "options", [[], ["--simplify", "all"], ["--method", "mc"], ["--placement", "centroid"]]
)
def test_values_are_those_that_the_report_sums_up(run, tmp_path, suffix, options):
    path, report = tmp_path / f"a.{suffix}", tmp_path / "r.json"
    assert run(*NOISE, path, *options, "--values", ALL, "--report", report).exit_code == 0
    told, mesh = json.loads(report.read_text()), read_mesh(path)
    quality, deviation, valence, thickness = (
        (mesh.face_values | mesh.vertex_values)[name] for name in ALL.split(",")
    )
    assert deviation.max() == pytest.approx(told["deviation"]["max"], rel=1e-6, abs=1e-12)
    assert deviation.mean() == pytest.approx(told["deviation"]["mean"], rel=1e-5, abs=1e-12)
    counts = Counter(valence.tolist())
    assert {str(v): counts[v] for v in sorted(counts)} == told["topology"]["valence_histogram"]
    if mesh.quad_count:
        assert quality.min() == pytest.approx(told["quality"]["shape_min"], rel=1e-5, abs=1e-7)
        assert quality.mean() == pytest.approx(told["quality"]["shape_mean"], rel=1e-5)
    else:
        assert quality.mean() == pytest.approx(told["quality"]["mean_ratio_mean"], rel=1e-5)
    walls = json.loads(run("measure", path, "--thickness", "--json").stdout)["thickness"]
    found = thickness[np.isfinite(thickness)]
    assert (len(found), found.min()) == (walls["vertices"], pytest.approx(walls["min"], rel=1e-5))
    assert told["settings"]["values"] == ALL.split(",")


def test_without_the_option_there_are_none(run, tmp_path):
    run(*NOISE, tmp_path / "a.ply")
    mesh = read_mesh(tmp_path / "a.ply")
    assert not mesh.vertex_values
    assert not mesh.face_values


@pytest.mark.parametrize("value", ALL.split(","))
@pytest.mark.parametrize("name", FORMATS)
def test_what_a_format_cannot_hold_is_refused_before_any_work(run, tmp_path, name, value):
    known = FORMATS[name]
    path = tmp_path / f"a{known.suffix}"
    result = run("convert", "synth:sphere:14", "-i", 0, path, "--values", value)  # which has walls everywhere
    if known.holds_face_values if value in FACE_VALUES else known.holds_vertex_values:
        assert result.exit_code == 0
        return
    assert result.exit_code == 2
    assert f"{value} was asked for (--values)" in result.stderr
    assert f"{known.title} files hold none; expected one of ply, " in " ".join(result.stderr.split())
    assert not path.exists()


def test_isovalues_that_share_a_file_keep_their_values(run, tmp_path):
    path = tmp_path / "a.glb"
    assert run(*NOISE, path, "-i", 0.1, "--values", "valence").exit_code == 0
    mesh = read_mesh(path)
    assert list(mesh.vertex_values) == ["valence"]
    assert len(mesh.vertex_values["valence"]) == len(mesh.points)
