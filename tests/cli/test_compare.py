"""`dmc compare`: methods beside each other, as a table and as figures."""

import csv
import io
import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from dmc_cli.app.closed_tunnels import ClosedTunnels
from dmc_cli.cli import comparison_table
from dmc_cli.figures import style
from dmc_cli.mesh_io import read_mesh
from dmc_cli.methods import METHODS
from dmc_cli.volume.volume import Volume

TORUS = ["compare", "synth:torus:24", "-i", 0.01, "--repeats", 1]


def test_all_methods_and_the_simplified_mesh_are_compared_without_a_list(run):
    rows = json.loads(run(*TORUS, "--format", "json").stdout)["methods"]
    assert [row["method"] for row in rows] == [*METHODS, "dmc+simplify"]
    assert min(row["time_ratio"] for row in rows) == 1.0
    for row in rows:
        assert (row["euler_characteristic"], row["components"]) == (0, 1)
        assert row["quads"] + row["triangles"] > 100
        assert row["surface_ms"] > 0
        assert row["self_intersections"] == row["non_manifold_edges"] == 0
        if "tmc" in METHODS:
            assert row["euler_difference"] == 0


def test_figures_are_those_of_the_reports_of_convert(run, tmp_path):
    rows = json.loads(run(*TORUS, "--format", "json", "--methods", "dmc,dmc:centroid").stdout)["methods"]
    for row, placement in zip(rows, ("exact", "centroid"), strict=True):
        path = tmp_path / f"{placement}.json"
        words = ["convert", "synth:torus:24", "-i", 0.01, "--placement", placement]
        run(*words, tmp_path / f"{placement}.ply", "--report", path)
        report = json.loads(path.read_text())
        assert (row["vertices"], row["quads"]) == (report["mesh"]["vertices"], report["mesh"]["quads"])
        assert row["deviation_mean_mm"] == report["deviation"]["mean_mm"]
        assert row["shape_mean"] == report["quality"]["shape_mean"]
        assert row["irregular_percent"] == report["topology"]["irregular_percent"]
        assert {name: row[name] for name in ("topology", "quality", "deviation")} == {
            name: report[name] for name in ("topology", "quality", "deviation")
        }


def test_an_isovalue_outside_is_answered_with_the_range(run):
    result = run("compare", "synth:torus:24", "-i", 99)
    assert result.exit_code == 5
    message = "there is no surface at isovalue 99: the values run from -1.03"
    assert message in " ".join(result.stderr.split())


def test_an_isovalue_is_chosen_as_convert_chooses_it(run, tmp_path):
    given = ["compare", "synth:torus:16", "--methods", "mc", "--format", "json", "--repeats", 1]
    run("convert", "synth:torus:16", tmp_path / "a.ply", "--method", "mc", "--report", tmp_path / "a.json")
    made = json.loads((tmp_path / "a.json").read_text())
    for words, choice in (
        ([], made["surface"]["choice"]),
        (["-i", "50%"], None),
        (["-i", "band:-0.2:0"], None),
    ):
        told = json.loads(run(*given, *words).stdout)
        assert told["choice"] == choice or told["choice"]["asked"] == words[1]
        run("convert", "synth:torus:16", tmp_path / "a.ply", "--method", "mc", "--force", *words)
        assert told["methods"][0]["vertices"] == len(read_mesh(str(tmp_path / "a.ply")).points)
    assert told["settings"]["isovalue"] == "band:-0.2:0"


def test_json_tells_what_was_compared_and_where(run):
    found = json.loads(run(*TORUS, "--format", "json", "--methods", "dmc,mc", "--border", "closed").stdout)
    assert found["schema"] == 1
    assert (found["warnings"], found["warning_codes"]) == ([], [])
    assert (found["input"]["path"], found["input"]["shape"]) == ("synth:torus:24", [24, 24, 24])
    told = {name: found["settings"][name] for name in ("isovalue", "border", "inside", "repeats", "device")}
    assert told == {"isovalue": 0.01, "border": "closed", "inside": "above", "repeats": 1, "device": "cpu"}
    assert found["euler_characteristic"] == 0
    assert [each["method"] for each in found["methods"]] == ["dmc", "mc"]
    assert "warp" in found["versions"]


@pytest.mark.parametrize("command", [TORUS, ["reproduce", "--table", 8, "--up-to", 64]])
def test_figures_go_to_a_folder_that_can_be_made(run, tmp_path, command):
    (tmp_path / "file").touch()
    for folder, status in ((tmp_path / "file", 2), (tmp_path / "file" / "inner", 9)):
        result = run(*command, "--figures", folder)
        assert result.exit_code == status
        assert str(folder) in "".join(result.stderr.split("\n"))
        assert result.stdout == ""


def test_an_empty_name_of_a_method_is_refused(run):
    for methods in (",", "dmc,", ""):
        result = run(*TORUS, "--methods", methods)
        assert result.exit_code == 2
        assert "empty name" in result.stderr


def test_memory_is_at_least_that_of_the_mesh(run):
    (row,) = json.loads(run(*TORUS, "--format", "json", "--methods", "dmc").stdout)["methods"]
    assert row["memory_bytes"] >= 12 * row["vertices"] + 16 * row["quads"]


def test_tables_are_text_csv_and_markdown(run):
    words = [*TORUS, "--methods", "dmc,dmc+simplify"]
    text = run(*words).stdout
    assert all(len(line) <= 80 for line in text.splitlines())
    assert "dmc+simplify" in text
    rows = list(csv.DictReader(io.StringIO(run(*words, "--format", "csv").stdout)))
    assert [row["method"] for row in rows] == ["dmc", "dmc+simplify"]
    assert int(rows[0]["quads"]) > int(rows[1]["quads"])
    lines = run(*words, "--format", "markdown").stdout.splitlines()
    assert lines[0].startswith("| method | vertices |")
    assert len({line.count("|") for line in lines[:4]}) == 1


NOISE = ["compare", "synth:noise:14", "-i", 0.01, "--border", "closed", "--repeats", 1]


def test_the_tunnels_that_dual_marching_cubes_closes_are_counted_and_placed(run):
    words = [*NOISE, "--methods", "dmc,dmc+simplify,dmc:asymptotic,tmc,mc", "--format", "json"]
    rows = {row["method"]: row for row in json.loads(run(*words).stdout)["methods"]}
    dmc = rows["dmc"]
    assert dmc["tunnels_closed"] > 10
    assert dmc["flipped_faces"] > 10
    assert dmc["euler_difference"] == 2 * (dmc["tunnels_closed"] + dmc["flipped_faces"])
    inside = [place for place in dmc["tunnels"] if place["face"] is None]
    through = [place for place in dmc["tunnels"] if place["face"] is not None]
    assert (len(inside), len(through)) == (dmc["tunnels_closed"], dmc["flipped_faces"])
    for place in inside:
        assert place["position"] == pytest.approx([2 / 13 * (index + 0.5) - 1 for index in place["cell"]])
    for place in through:
        shift = [1.0 if axis == place["face"] else 0.5 for axis in "xyz"]
        expected = [2 / 13 * (index + own) - 1 for index, own in zip(place["cell"], shift, strict=True)]
        assert place["position"] == pytest.approx(expected)
    assert rows["dmc+simplify"]["tunnels"] == dmc["tunnels"]
    asymptotic = rows["dmc:asymptotic"]
    assert (asymptotic["tunnels_closed"], asymptotic["flipped_faces"]) == (len(inside), 0)
    assert (rows["tmc"]["tunnels_closed"], rows["tmc"]["tunnels"]) == (0, [])
    assert (rows["mc"]["tunnels_closed"], rows["mc"]["tunnels"]) == (None, None)


def test_the_tables_tell_where_the_first_tunnels_are(run):
    words = [*NOISE, "--methods", "dmc"]
    (row,) = json.loads(run(*words, "--format", "json").stdout)["methods"]
    text, markdown = run(*words).stdout, run(*words, "--format", "markdown").stdout
    i, j, k = row["tunnels"][0]["cell"]
    more = row["tunnels_closed"] + row["flipped_faces"] - 8
    for table in (text, markdown):
        assert (
            f"dmc closes {row['tunnels_closed']} tunnels inside a cell and has {row['flipped_faces']}"
            in table
        )
        assert f" cell {i}, {j}, {k}, at " in table
        assert f"and {more} more" in table
    assert "closes" not in run(*TORUS, "--methods", "dmc").stdout


def test_places_of_tunnels_follow_uneven_slices():
    affine = np.diag([1.0, 1.0, 2.0, 1.0])
    affine[:3, 3] = [10, 20, 30]
    values, positions = np.zeros((3, 3, 3)), np.array([0.0, 2.0, 8.0])
    volume = Volume(values=values, affine=affine, space="none", slice_positions=positions)
    closed = ClosedTunnels(np.array([[0, 1, 1], [0, 0, -1]]), np.array([[0, 0, 0, 2]]))
    assert [place["position"] for place in closed.places(volume)] == [
        [10.5, 21.5, 35.0],
        [10.5, 20.5, 29.0],
        [10.5, 20.5, 32.0],
    ]
    assert [place["face"] for place in closed.places(volume)] == [None, None, "z"]


def test_lines_break_where_a_column_would_not_fit():
    rows = [dict.fromkeys(["method"], "a" * 60) | {"vertices": 10**9, "quads": 10**9}]
    (row,) = rows
    for part in comparison_table.PARTS:
        row |= {key: row.get(key) for _, key, _ in part}
    row["memory_bytes"] = None
    lines = list(comparison_table.text_table(rows, {}))
    assert all(len(line) <= 80 for line in lines)
    headings = [word for line in lines if line.startswith("method") for word in line.split()[1:]]
    assert headings == [
        word for part in comparison_table.PARTS for name, _, _ in part for word in name.split()
    ]


@pytest.mark.parametrize("border", ["open", "closed"])
def test_the_border_is_that_of_all_methods(run, border):
    words = ["compare", "synth:iwp:16", "-i", 0.01, "--repeats", 1, "--format", "json", "--border", border]
    for row in json.loads(run(*words).stdout)["methods"]:
        assert row["components"] > 0


def test_the_papers_figures_are_drawn(run, tmp_path):
    assert run(*TORUS, "--methods", "dmc,dmc+simplify", "--figures", tmp_path / "a" / "b").exit_code == 0
    names = ["deviation", "quad_quality", "triangle_quality", "valences"]
    drawn = tmp_path / "a" / "b"
    assert sorted(path.name for path in drawn.iterdir()) == sorted(
        f"{name}.{kind}" for name in names for kind in ("png", "svg")
    )
    for name in names:
        with Image.open(drawn / f"{name}.png") as image:
            assert min(image.size) > 500
            assert len(image.convert("RGB").getcolors(1 << 20)) > 20
        text = "".join(ET.parse(drawn / f"{name}.svg").getroot().itertext())
        assert ("before" if name == "valences" else "dmc+simplify") in text


def test_figures_have_the_same_bytes_on_every_run(run, tmp_path):
    for folder in ("a", "b"):
        run(*TORUS, "--methods", "dmc", "--figures", tmp_path / folder)
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--methods", "nothing"], "expected one of dmc"),
        (["--methods", "dmc:nothing"], "no value of an option of the method dmc; expected one of"),
        (["--methods", "dmc,dmc"], "expected each once"),
        (["--repeats", "0"], "expected 1 or more"),
        (["--figures", "{}/file"], "expected a folder"),
    ],
)
def test_what_cannot_be_compared_is_refused(run, tmp_path, words, message):
    (tmp_path / "file").write_text("")
    result = run(*TORUS[:4], *[word.format(tmp_path) for word in words])
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


def test_no_surface_is_told(run):
    assert run("compare", "synth:torus:24", "-i", 99).exit_code == 5


def test_without_matplotlib_the_way_to_it_is_told(run, tmp_path, monkeypatch):
    monkeypatch.setattr(style, "find_spec", lambda _name: None)
    result = run(*TORUS, "--figures", tmp_path / "f")
    assert result.exit_code == 2
    assert "dmc-cli[plots]" in result.stderr
