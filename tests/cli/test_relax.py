"""`--relax N`: better shapes on the surface, with and without simplification."""

import json

import numpy as np
import pytest

CONVERT = ("convert", "synth:genus_two:48")


def report_of(run, tmp_path, *options):
    path = tmp_path / "report.json"
    words = ("-i", 0, "--report", path, "--check", "--force", *options)
    assert run(*CONVERT, tmp_path / "mesh.ply", *words).exit_code == 0
    return json.loads(path.read_text())


@pytest.mark.parametrize("simplify", ["none", "all"])
@pytest.mark.parametrize("border", ["open", "closed"])
def test_the_mean_shape_rises_on_the_surface(run, tmp_path, simplify, border):
    options = ("--simplify", simplify, "--border", border, "--require", "manifold,on-surface")
    plain = report_of(run, tmp_path, *options)
    relaxed = report_of(run, tmp_path, *options, "--relax", 5)
    assert relaxed["settings"]["relax"] == 5
    assert relaxed["timings_ms"]["relax"] > 0
    assert relaxed["quality"]["shape_mean"] > plain["quality"]["shape_mean"] + 0.01
    assert relaxed["quality"]["shape_min"] >= plain["quality"]["shape_min"] - 1e-5
    assert relaxed["deviation"]["max_relative"] <= 1e-5
    assert relaxed["topology"] == plain["topology"]


def test_the_colours_of_the_dump_stay_those_of_the_cells(run, tmp_path):
    dumps = []
    for steps in (0, 3):
        path = tmp_path / f"{steps}.npz"
        run(*CONVERT, tmp_path / "mesh.ply", "-i", 0, "--halfedges", path, "--relax", steps, "--force")
        with np.load(path) as file:
            dumps.append(dict(file))
    for name in ("vertex_color", "face_color", "halfedges", "quads"):
        np.testing.assert_array_equal(dumps[0][name], dumps[1][name])
    assert (dumps[0]["vertices"] != dumps[1]["vertices"]).any()


def test_a_negative_number_of_steps_is_refused(run, tmp_path):
    result = run(*CONVERT, tmp_path / "mesh.ply", "-i", 0, "--relax", -1)
    assert result.exit_code == 2
    assert "relax is -1; expected a number of steps" in result.stderr
