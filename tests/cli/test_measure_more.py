"""`dmc measure` beyond a mesh alone: distance to another one, curvature; and what a report tells of them."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from dmc_cli.mesh_io import MeshFile, write_mesh
from tests import shapes

SCHEMA = json.loads((Path(__file__).parents[2] / "docs/report-schema.json").read_text("utf-8"))
TORUS = "synth:torus:20"


def written(path, shape, **more):
    """The path of a file of a shape."""
    points, faces = shape
    write_mesh(path, MeshFile(points=points.astype(np.float32), faces=faces, **more))
    return path


def section_schema(name):
    return {"$ref": f"#/$defs/{name}", "$defs": SCHEMA["$defs"]}


@pytest.fixture
def plates(tmp_path):
    """Two plates a quarter apart."""
    plate = shapes.grid(4, 3)
    moved = shapes.moved(plate, (0, 0, 0.25))
    return written(tmp_path / "a.ply", plate), written(tmp_path / "b.ply", moved)


def test_the_distance_is_told_both_ways(run, plates):
    found = json.loads(run("measure", plates[0], "--against", plates[1], "--density", 100, "--json").stdout)
    distance = found["distance"]
    jsonschema.validate(distance, section_schema("distance"))
    assert list(distance) == list(SCHEMA["$defs"]["distance"]["properties"])
    assert (distance["path"], distance["unit"], distance["density"]) == (str(plates[1]), "mm", 100.0)
    for way in ("to_other", "from_other", "both"):
        assert list(distance[way]) == list(SCHEMA["$defs"]["way"]["properties"])
        assert distance[way]["max"] == distance[way]["mean"] == pytest.approx(0.25)
    text = run("measure", plates[0], "--against", plates[1], "--density", 100).stdout
    assert "distance  to the other mesh: mean 0.25, 95 % within 0.25, at most 0.25 mm (1200 samples)" in text
    assert "          from it: mean 0.25" in text


def test_without_another_mesh_there_is_no_distance(run, plates):
    found = json.loads(run("measure", plates[0], "--json").stdout)
    assert (found["distance"], found["curvature"]) == (None, None)
    assert "distance" not in run("measure", plates[0]).stdout


def test_units_and_axes_may_differ(run, tmp_path):
    points, faces = shapes.torus(12, 8)
    first = written(tmp_path / "a.ply", (points, faces), space="RAS", unit="um")
    turned = written(tmp_path / "b.ply", (points * (-1e-3, -1e-3, 1e-3), faces), space="LPS")
    found = json.loads(run("measure", first, "--against", turned, "--json").stdout)
    assert found["warnings"] == []
    assert found["distance"]["unit"] == "um"
    assert found["distance"]["both"]["max"] < 1e-6


def test_a_mesh_without_a_space_is_taken_for_one_of_the_other_s(run, tmp_path):
    first = written(tmp_path / "a.ply", shapes.torus(12, 8), space="LPS")
    other = written(tmp_path / "b.ply", shapes.torus(12, 8))
    found = json.loads(run("measure", first, "--against", other, "--json").stdout)
    assert found["warning_codes"] == ["W-SPACE-UNKNOWN"]
    assert found["distance"]["both"]["max"] < 1e-6


def test_what_is_not_read_of_the_other_mesh_is_told(run, plates, tmp_path):
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
    found = json.loads(run("measure", plates[0], "--against", tmp_path / "b.obj", "--json").stdout)
    assert found["warning_codes"] == ["W-MESH-UNREAD"]


@pytest.mark.parametrize(
    ("words", "status", "named"),
    [
        (["--density", 5], 2, "--against"),
        (["--against", "PLATE", "--density", 0], 2, "density is 0.0"),
        (["--against", "PLATE", "--density", "nan"], 2, "density is nan"),
        (["--against", "PLATE", "--density", 1e15], 2, "expected at most 1000000000"),
        (["--against", "missing.ply"], 3, "missing.ply: no such file"),
        (["--against", "HUGE"], 3, "coordinates up to"),
    ],
)
def test_what_cannot_be_measured_is_refused(run, plates, tmp_path, words, status, named):
    huge = tmp_path / "huge.off"
    huge.write_text("OFF\n# UNIT=m\n3 1 0\n0 0 0\n1e38 0 0\n0 1e38 0\n3 0 1 2\n")
    paths = {"PLATE": plates[1], "HUGE": huge}
    result = run("measure", plates[0], *(paths.get(word, word) for word in words))
    assert result.exit_code == status
    assert named in result.stderr
    assert result.stdout == ""


def test_curvature_is_told_on_request(run, tmp_path):
    points, faces = shapes.sphere(20)
    ball = written(tmp_path / "ball.ply", (2 * points, faces))
    found = json.loads(run("measure", ball, "--curvature", "--json").stdout)["curvature"]
    schema = SCHEMA["properties"]["curvature"]
    jsonschema.validate(found, {**schema, "$defs": SCHEMA["$defs"]})
    assert list(found) == list(schema["properties"])
    assert list(found["mean"]) == list(SCHEMA["$defs"]["spread"]["properties"])
    assert found["mean"]["mean"] == pytest.approx(0.5, rel=1e-2)
    assert found["total_gaussian"] == pytest.approx(4 * np.pi, rel=1e-6)
    text = run("measure", ball, "--curvature").stdout
    assert "curvature mean: 0.5 over the area" in text
    assert "          Gaussian: 0.25 over the area" in text


def test_a_report_has_curvature_on_request_and_intersections_always(run, tmp_path):
    reports = {}
    for name, words in {"plain": [], "curved": ["--curvature"]}.items():
        path = tmp_path / f"{name}.json"
        assert (
            run("convert", TORUS, tmp_path / "a.ply", "-i", 0, "--report", path, "--force", *words).exit_code
            == 0
        )
        reports[name] = json.loads(path.read_text())
        jsonschema.validate(reports[name], SCHEMA)
        assert reports[name]["quality"]["self_intersections"] == 0
    assert reports["plain"]["curvature"] is None
    assert reports["curved"]["curvature"]["total_gaussian"] == pytest.approx(0, abs=1e-6)
    assert reports["curved"]["settings"]["curvature"] is True


def test_curvature_without_a_report_is_refused(run, tmp_path):
    result = run("convert", TORUS, tmp_path / "a.ply", "-i", 0, "--curvature")
    assert result.exit_code == 2
    assert "--report" in result.stderr


def crossed(run, path):
    """The number that `dmc measure` finds."""
    return json.loads(run("measure", path, "--json").stdout)["quality"]["self_intersections"]


def test_intersections_are_counted_and_refused(run, tmp_path):
    boxes = shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (0.5, 0.5, 0.5)))
    path = written(tmp_path / "boxes.off", boxes)
    assert crossed(run, path) == 6
    assert "faces     6 pair(s) intersect" in run("measure", path).stdout
    words = ["synth:noise:24", tmp_path / "noise.ply", "-i", 1.5, "--require", "no-self-intersections"]
    result = run("convert", *words, "--no-repair-intersections")
    assert result.exit_code == 6
    assert "no-self-intersections:" in result.stderr
    assert not (tmp_path / "noise.ply").exists()
    assert run("convert", TORUS, tmp_path / "t.ply", "-i", 0, *words[4:]).exit_code == 0


def test_the_thickness_of_walls(run, tmp_path):
    path = tmp_path / "ball.ply"
    assert run("convert", "synth:sphere:32", path, "-i", 0, "--quiet").exit_code == 0
    assert json.loads(run("measure", path, "--json").stdout)["thickness"] is None
    found = json.loads(run("measure", path, "--wall", 1.6, "--json").stdout)["thickness"]
    assert found["median"] == pytest.approx(1.5, rel=0.01)
    assert (found["limit"], found["percent_below"]) == (1.6, pytest.approx(100))
    told = run("measure", path, "--thickness").stdout
    assert "thickness at least 1.5 mm, of half the area at most 1.5 mm\n" in told
    assert "0.00 % of the area below 1 mm" in run("measure", path, "--wall", 1).stdout
    assert run("measure", path, "--wall", 0).exit_code == 2
