"""`dmc convert --labels` writes what it says, and refuses what cannot be done before anything is written."""

import json

import jsonschema
import nrrd
import numpy as np
import pytest

from dmc_cli import ConvertSettings, LabelSettings, OutputSettings, convert_labels
from dmc_cli.mesh_io import read_mesh
from tests.conftest import ROOT


def three_boxes():
    """Two boxes with a common wall, and one apart: labels 1, 2 and 40."""
    labels = np.zeros((12, 14, 16), np.uint8)
    labels[3:9, 3:9, 2:6], labels[3:9, 3:9, 6:10], labels[4:8, 9:12, 12:15] = 1, 2, 40
    return labels


@pytest.fixture
def boxes(tmp_path):
    """A NRRD file of the boxes in a left-handed space: spacing 1 x -2 x 3 mm."""
    path = tmp_path / "boxes.nrrd"
    header = {"space": "left-posterior-superior", "space directions": np.diag([1.0, -2.0, 3.0])}
    nrrd.write(str(path), three_boxes().T, header | {"space origin": [5, 6, 7]})
    return path


def enclosed(mesh):
    a, b, c, d = (mesh.points[mesh.faces[:, n]].astype(float) for n in range(4))
    tetrahedra = ((a, b, c), (a, c, d), (a, b, d), (b, c, d))
    return sum(np.einsum("qi,qi->", x, np.cross(y, z)) for x, y, z in tetrahedra) / 12


def test_a_template_gives_a_file_a_label_in_folders_that_are_made(run, tmp_path, boxes):
    template = tmp_path / "shells" / "{stem}" / "{label:03d}_{name}.ply"
    result = run("convert", boxes, template, "--labels", "all")
    assert result.exit_code == 0, result.stderr
    folder = tmp_path / "shells" / "boxes"
    assert sorted(path.name for path in folder.iterdir()) == [
        "001_label_1.ply",
        "002_label_2.ply",
        "040_label_40.ply",
    ]
    assert "label     40: 36 nodes" in result.stderr
    for label in (1, 2, 40):
        mesh = read_mesh(str(folder / f"{label:03d}_label_{label}.ply"))
        nodes = (three_boxes() == label).sum() * 6.0
        assert enclosed(mesh) == pytest.approx(nodes, rel=0.01)  # positive: it looks outwards
        assert mesh.space == "LPS"
        middle = mesh.points - mesh.points.mean(axis=0)
        assert (np.einsum("vi,vi->v", mesh.normals, middle) > 0).all()


def test_chosen_labels_alone(run, tmp_path, boxes):
    assert run("convert", boxes, tmp_path / "{label}.ply", "--labels", "2,40").exit_code == 0
    assert sorted(path.name for path in tmp_path.glob("*.ply")) == ["2.ply", "40.ply"]
    assert run("convert", boxes, tmp_path / "one.ply", "--labels", "1").exit_code == 0
    assert (tmp_path / "one.ply").is_file()


def test_one_file_with_groups(run, tmp_path, boxes):
    assert run("convert", boxes, tmp_path / "a.obj", "--labels", "all").exit_code == 0
    lines = (tmp_path / "a.obj").read_text().splitlines()
    assert [line for line in lines if line.startswith("g ")] == ["g label_1", "g label_2", "g label_40"]


def test_a_conforming_mesh_has_the_labels_of_both_sides(run, tmp_path, boxes):
    result = run("convert", boxes, tmp_path / "a.ply", "--labels", "all", "--conforming")
    assert result.exit_code == 0, result.stderr
    mesh = read_mesh(str(tmp_path / "a.ply"))
    pairs = mesh.face_values["labels"]
    assert {tuple(pair) for pair in pairs.tolist()} == {(1, 0), (2, 0), (2, 1), (40, 0)}
    assert (pairs == [2, 1]).all(axis=1).sum() == 36  # the wall of 6 x 6 nodes, once
    a, b, c, d = (mesh.points[mesh.faces[:, n]].astype(float) for n in range(4))
    volumes = np.einsum("qi,qi->q", np.cross(a, b), c + d) + np.einsum("qi,qi->q", np.cross(c, d), a + b)
    for label in (1, 2, 40):
        total = (volumes[pairs[:, 0] == label].sum() - volumes[pairs[:, 1] == label].sum()) / 12
        assert total == pytest.approx((three_boxes() == label).sum() * 6.0, rel=0.01)


def test_a_conforming_obj_has_a_group_a_pair(run, tmp_path, boxes):
    assert run("convert", boxes, tmp_path / "a.obj", "--conforming").exit_code == 0
    groups = [line for line in (tmp_path / "a.obj").read_text().splitlines() if line.startswith("g ")]
    assert groups == [
        "g label_1--background",
        "g label_2--background",
        "g label_2--label_1",
        "g label_40--background",
    ]


def test_the_report_has_a_row_a_label(run, tmp_path, boxes):
    report_file = tmp_path / "r.json"
    words = [
        "--labels",
        "all",
        "--report",
        report_file,
        "--require",
        "manifold,closed,all-quads,no-self-intersections,scaled_jacobian_min>0",
    ]
    assert run("convert", boxes, tmp_path / "{label}.ply", *words).exit_code == 0
    report = json.loads(report_file.read_text())
    jsonschema.validate(report, json.loads((ROOT / "docs" / "labels-report-schema.json").read_text()))
    assert [row["label"] for row in report["labels"]] == [1, 2, 40]
    row = report["labels"][2]
    assert (row["nodes"], row["node_volume"]) == (36, 216.0)
    assert abs(row["mesh"]["volume_change_percent"]) < 1
    assert row["topology"]["components"] == 1
    assert row["quality"]["self_intersections"] == report["mesh"]["self_intersections"] == 0
    assert row["path"] == str(tmp_path / "40.ply")
    assert report["settings"]["labels"] == ["all"]


def test_a_shell_that_is_not_what_is_required_is_named_and_nothing_written(run, tmp_path, boxes):
    words = ["--labels", "all", "--require", "quads>=100", "--report", tmp_path / "r.json"]
    result = run("convert", boxes, tmp_path / "o" / "{label}.ply", *words)
    assert result.exit_code == 6
    assert "label 40: the mesh is not what --require asks for: quads>=100: 66 was found" in " ".join(
        result.stderr.split()
    )
    assert "label 1:" not in result.stderr
    assert not (tmp_path / "o").exists()
    rows = json.loads((tmp_path / "r.json").read_text())["labels"]
    assert [row["requirements"][0]["met"] for row in rows] == [True, True, False]


def test_grid_coordinates_and_units(run, tmp_path, boxes):
    run("convert", boxes, tmp_path / "v.ply", "--labels", "40", "--space", "voxel", "--no-normals")
    mesh = read_mesh(str(tmp_path / "v.ply"))
    assert mesh.normals is None
    assert enclosed(mesh) == pytest.approx(36, rel=0.01)
    assert (mesh.points.min(axis=0) >= [11, 8, 3]).all()
    run("convert", boxes, tmp_path / "u.ply", "--labels", "40", "--unit", "m")
    assert enclosed(read_mesh(str(tmp_path / "u.ply"))) == pytest.approx(216e-9, rel=0.01)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["a/{label}.ply", "--labels", "3"], "has the label 3; expected all, or one of 1, 2, 40"),
        (
            ["a.ply", "--labels", "all"],
            "one file for the shells of 3 labels; expected a template with {label}",
        ),
        (["a/{label}.ply", "--conforming"], "is a template, but a conforming mesh is one file"),
        (["a/{name}_{color}.ply", "--labels", "all"], "found {color}; expected {label}"),
        (["a/{label}.ply", "--labels", "all", "-i", "0.5"], "--isovalue was given with labels"),
        (["a/{label}.ply", "--labels", "all", "--simplify", "all"], "--simplify was given with labels"),
        (
            ["a.ply", "--conforming", "--quads", "50%"],
            "the labels share one mesh, whose quads stay as they are",
        ),
        (
            ["a/{label}.ply", "--labels", "all", "--quads", "9", "--relax", "2"],
            "--relax was given with labels",
        ),
        (["a/{label}.ply", "--labels", "all", "--quads", "none"], "expected a number of quads"),
        (["a/{label}.ply", "--labels", "all", "--cut-table"], "labels are names; leave them out with labels"),
        (["a/{label}.ply", "--labels", "all", "--smooth-volume", "1"], "labels are names; leave them out"),
        (["a/{label}.ply", "--labels", "all", "--crop", "20:30,:,:"], "x ends at node 15"),
        (["a/{label}.ply", "--labels", "all", "--halfedges", "h.npz"], "leave them out with labels"),
        (
            ["a/{label}.ply", "--labels", "all", "--require", "on-surface"],
            "on-surface was required of labels",
        ),
        (["a/{label}.xyz", "--labels", "all"], "has the suffix .xyz; expected one of"),
        (["a/{label}.ply", "--labels", "1,,2"], "has an empty name"),
    ],
)
def test_what_cannot_be_done_is_said_and_nothing_written(run, tmp_path, monkeypatch, boxes, words, message):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    result = run("convert", boxes, *words)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert sorted(tmp_path.iterdir()) == before


@pytest.fixture
def tooth(sample_data):
    return sample_data / "labels" / "tooth.seg.nrrd"


def test_each_shell_has_the_size_that_is_asked_for(run, tmp_path, tooth):
    report = tmp_path / "r.json"
    required = ("--require", "closed,manifold,no-self-intersections")
    words = ("--labels", "all", "--quads", "10%", "--report", report, *required)
    result = run("convert", tooth, tmp_path / "{name}.ply", *words)
    assert result.exit_code == 0, result.stderr
    found = json.loads(report.read_text())
    meshes = [read_mesh(row["path"]) for row in found["labels"]]
    for row, mesh in zip(found["labels"], meshes, strict=True):
        size, whole = row["size"], row["nodes"]
        assert size["quads"] == round(size["quads_before"] / 10) == row["mesh"]["quads"] == len(mesh.faces)
        assert size["to_before"]["max"] < 1.5
        assert (
            enclosed(mesh) == pytest.approx(row["mesh"]["volume"], rel=1e-5) == pytest.approx(whole, rel=0.01)
        )
        assert np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 1e-5
        assert f"{size['quads']} of {size['quads_before']} quads" in result.stderr
    assert found["mesh"]["quads"] == sum(len(mesh.faces) for mesh in meshes)
    assert found["settings"]["quads"] == "10%"
    assert found["warning_codes"].count("W-SHELLS-APART") == 1


def test_a_bound_holds_for_each_shell_in_millimetres(run, tmp_path, tooth):
    words = ("--labels", "enamel", "--space", "voxel")
    assert run("convert", tooth, tmp_path / "fine.ply", *words).exit_code == 0
    result = run("convert", tooth, tmp_path / "coarse.ply", *words, "--max-error", 0.3)
    assert result.exit_code == 0
    assert "W-SHELLS-APART" not in result.stderr
    told = json.loads(
        run("measure", tmp_path / "coarse.ply", "--against", tmp_path / "fine.ply", "--json").stdout
    )
    assert told["distance"]["both"]["max"] <= 0.3
    assert told["mesh"]["quads"] < len(read_mesh(tmp_path / "fine.ply").faces) / 5


def test_a_size_that_a_shell_has_not_is_told_with_its_label(run, tmp_path, boxes):
    words = ("--labels", "all", "--quads", 100)
    result = run("convert", boxes, tmp_path / "{label}.ply", *words)
    assert result.exit_code == 0
    assert "label 40: the mesh has 66 quads, no more than the 100 that were asked for" in result.stderr
    assert [len(read_mesh(tmp_path / f"{n}.ply").faces) for n in (1, 2, 40)] == [100, 100, 66]


def test_the_part_of_each_label_that_is_wanted(run, tmp_path):
    labels = three_boxes()
    labels[5, 5, 3] = labels[5, 5, 4] = 0  # a cavity in 1
    labels[1, 1, 1] = 2  # a speck
    np.save(tmp_path / "a.npy", labels)
    words = ["--labels", "all", "--crop", "0:11,:,:", "--keep", "largest", "--fill-cavities"]
    words += ["--report", tmp_path / "r.json"]
    result = run("convert", tmp_path / "a.npy", tmp_path / "{label}.ply", *words)
    assert result.exit_code == 0, result.stderr
    assert sorted(path.name for path in tmp_path.glob("*.ply")) == ["1.ply", "2.ply"]
    assert "part      1 component(s) dropped: 1 nodes, 1 mm³" in result.stderr
    assert "part      1 cavity filled: 2 nodes, 2 mm³" in result.stderr
    report = json.loads((tmp_path / "r.json").read_text())
    jsonschema.validate(report, json.loads((ROOT / "docs" / "labels-report-schema.json").read_text()))
    assert report["warning_codes"][-1] == "W-LABELS-GONE"
    assert report["warnings"][-1] == "labels that the part which was taken has no node of: 40"
    first, second = report["labels"]
    assert (first["nodes"], first["part"]["filled"]) == (144, {"components": 1, "nodes": 2, "volume": 2.0})
    assert (second["nodes"], second["part"]["dropped"]["nodes"]) == (144, 1)
    assert read_mesh(str(tmp_path / "1.ply")).points.max() < 9


def test_labels_at_other_distances_lie_where_they_were(run, tmp_path, boxes):
    words = ["--labels", "all", "--resample", "isotropic", "--no-normals"]
    assert run("convert", boxes, tmp_path / "{label}.ply", *words).exit_code == 0
    for label in (1, 2, 40):
        mesh = read_mesh(str(tmp_path / f"{label}.ply"))
        k, j, i = np.nonzero(three_boxes() == label)
        middle = [5 + i.mean(), 6 - 2 * j.mean(), 7 + 3 * k.mean()]
        assert np.abs((mesh.points.min(axis=0) + mesh.points.max(axis=0)) / 2 - middle).max() <= 0.6
        assert enclosed(mesh) == pytest.approx((three_boxes() == label).sum() * 6.0, rel=0.1)


def test_a_part_without_a_label_is_refused_or_empty(run, tmp_path, boxes):
    words = ["--labels", "40", "--crop", ":5,:,:"]
    result = run("convert", boxes, tmp_path / "{label}.ply", *words)
    assert result.exit_code == 5
    assert "no node is left of 40; expected some; take a larger part" in " ".join(result.stderr.split())
    assert run("convert", boxes, tmp_path / "a.ply", *words, "--allow-empty").exit_code == 0
    assert b"element vertex 0" in (tmp_path / "a.ply").read_bytes()


def test_an_existing_file_is_kept(run, tmp_path, boxes):
    (tmp_path / "2.ply").write_text("mine")
    result = run("convert", boxes, tmp_path / "{label}.ply", "--labels", "all")
    assert result.exit_code == 9
    assert (tmp_path / "2.ply").read_text() == "mine"
    assert not (tmp_path / "1.ply").exists()
    assert run("convert", boxes, tmp_path / "{label}.ply", "--labels", "all", "--force").exit_code == 0


def test_a_map_without_labels_is_empty(run, tmp_path):
    nrrd.write(str(tmp_path / "none.nrrd"), np.zeros((3, 3, 3), np.uint8))
    result = run("convert", tmp_path / "none.nrrd", tmp_path / "{label}.ply", "--labels", "all")
    assert result.exit_code == 5
    assert "has no label: every node is background (0)" in result.stderr
    allowed = run("convert", tmp_path / "none.nrrd", tmp_path / "a.ply", "--labels", "all", "--allow-empty")
    assert allowed.exit_code == 0, allowed.stderr


def test_values_that_are_no_labels_are_refused(run, tmp_path):
    result = run("convert", "synth:sphere:8", tmp_path / "a.ply", "--labels", "all")
    assert result.exit_code == 3
    assert "is no label map" in result.stderr


def test_too_little_memory_is_told_before_the_work(run, tmp_path, boxes):
    result = run("convert", boxes, tmp_path / "{label}.ply", "--labels", "all", "--memory", "8K")
    assert result.exit_code == 7
    assert "the label map and its codes need" in result.stderr


def test_the_api_does_the_same(tmp_path, boxes):
    output = OutputSettings(path=str(tmp_path / "{label}.ply"), dry_run=True)
    result = convert_labels(LabelSettings(input=str(boxes), output=output, labels=("1", "2")))
    assert sorted(result.meshes) == [str(tmp_path / "1.ply"), str(tmp_path / "2.ply")]
    assert list(tmp_path.glob("*.ply")) == []
    assert ConvertSettings is not LabelSettings


def test_info_lists_the_labels(run, tmp_path, sample_data):
    shown = run("info", sample_data / "labels" / "tooth.seg.nrrd").stdout
    assert "label     1 dentine: 316201 nodes\nlabel     2 enamel: 109583 nodes\n" in shown
    named = {f"Segment{n}_{key}": f"{n + 1}" for n in (0, 1) for key in ("ID", "Name", "LabelValue")}
    nrrd.write(str(tmp_path / "a.nrrd"), three_boxes().T, named)
    found = json.loads(run("info", tmp_path / "a.nrrd", "--json").stdout)
    assert found["labels"][1:] == [
        {"label": 2, "name": "2", "color": None, "nodes": 144},
        {"label": 40, "name": "", "color": None, "nodes": 36},
    ]
    assert "labels" not in json.loads(run("info", "synth:sphere:8", "--json").stdout)


def test_a_batch_has_a_line_a_label(run, tmp_path, boxes):
    noise = np.zeros((9, 9, 9), np.uint8)
    noise[2:6, 2:6, 2:6] = 5
    np.save(tmp_path / "b.npy", noise)
    np.save(tmp_path / "c.npy", np.full((4, 4, 4), 0.5))
    words = ["--labels", "all", "-o", tmp_path / "o" / "{stem}" / "{name}_{label:03d}.ply", "--jobs", "2"]
    result = run(
        "batch", boxes, tmp_path / "b.npy", tmp_path / "c.npy", *words, "--junit", tmp_path / "j.xml"
    )
    assert result.exit_code == 8
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["label"] for line in lines] == [1, 2, 40, 5, None]
    assert [line["status"] for line in lines] == [0, 0, 0, 0, 3]
    assert [line["isovalue"] for line in lines] == [None] * 5
    assert "is no label map" in lines[4]["error"]
    for line in lines[:4]:
        assert len(read_mesh(line["output"]).faces) == line["quads"] > 0
        assert 0 < line["quality"]["shape_min"] <= line["quality"]["shape_mean"] <= 1
    assert lines[3]["output"] == str(tmp_path / "o" / "b" / "label_5_005.ply")
    assert not (tmp_path / "o" / "c").exists()
    text = (tmp_path / "j.xml").read_text()
    assert 'tests="5" failures="0" errors="1" skipped="0"' in text
    assert '<property name="label" value="40"/>' in text


def test_a_batch_of_labels_names_what_is_not_required_and_shared_meshes(run, tmp_path, boxes):
    words = ["--labels", "all", "-o", tmp_path / "{stem}_{label}.ply", "--require", "quads>=100"]
    result = run("batch", boxes, *words)
    assert result.exit_code == 8
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["requirements"][0]["met"] for line in lines] == [True, True, False]
    assert {line["status"] for line in lines} == {6}
    assert not list(tmp_path.glob("*.ply"))
    (line,) = run("batch", boxes, "--conforming", "-o", tmp_path / "{stem}.ply").stdout.splitlines()
    found = json.loads(line)
    assert (found["label"], found["output"]) == (None, str(tmp_path / "boxes.ply"))
    assert len(read_mesh(found["output"]).faces) == found["quads"]


def test_a_batch_file_of_labels(run, tmp_path, boxes):
    (tmp_path / "s.toml").write_text(
        'inputs = "boxes.nrrd"\nlabels = "1,2"\nquads = 80\noutput = "s_{label}.ply"\n'
    )
    lines = run("batch", tmp_path / "s.toml").stdout.splitlines()
    assert [json.loads(line)["quads"] for line in lines] == [80, 80]
    (tmp_path / "a.toml").write_text('inputs = "boxes.nrrd"\nlabels = "1,40"\nkeep = "largest"\n')
    lines = run("batch", tmp_path / "a.toml").stdout.splitlines()
    assert [json.loads(line)["output"] for line in lines] == [
        str(tmp_path / f"boxes_{label}.ply") for label in (1, 40)
    ]
    (tmp_path / "b.toml").write_text('inputs = "boxes.nrrd"\nlabels = "1"\nsimplify = "all"\n')
    result = run("batch", tmp_path / "b.toml")
    assert result.exit_code == 2
    assert "--simplify was given with labels" in result.stderr
