"""`dmc compare`: methods beside each other, as a table and as figures."""

import csv
import io
import json
import xml.etree.ElementTree as ET

import pytest
from PIL import Image

from dmc_cli.figures import style
from dmc_cli.methods import METHODS

TORUS = ["compare", "synth:torus:24", "-i", 0.01, "--repeats", 1]


def test_all_methods_and_the_simplified_mesh_are_compared_without_a_list(run):
    rows = json.loads(run(*TORUS, "--format", "json").stdout)
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
    rows = json.loads(run(*TORUS, "--format", "json", "--methods", "dmc,dmc:centroid").stdout)
    for row, placement in zip(rows, ("exact", "centroid"), strict=True):
        path = tmp_path / f"{placement}.json"
        words = ["convert", "synth:torus:24", "-i", 0.01, "--placement", placement]
        run(*words, tmp_path / f"{placement}.ply", "--report", path)
        report = json.loads(path.read_text())
        assert (row["vertices"], row["quads"]) == (report["mesh"]["vertices"], report["mesh"]["quads"])
        assert row["deviation_mean_mm"] == report["deviation"]["mean_mm"]
        assert row["shape_mean"] == report["quality"]["shape_mean"]
        assert row["irregular_percent"] == report["topology"]["irregular_percent"]


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        ([], 2, "no isovalue was given; synth:torus:24 has values from -1.03"),
        (["-i", 99], 5, "there is no surface at isovalue 99: the values run from -1.03"),
    ],
)
def test_an_isovalue_that_is_missing_or_outside_is_answered_with_the_range(run, words, status, message):
    result = run("compare", "synth:torus:24", *words)
    assert result.exit_code == status
    assert message in " ".join(result.stderr.split())


def test_memory_is_at_least_that_of_the_mesh(run):
    (row,) = json.loads(run(*TORUS, "--format", "json", "--methods", "dmc").stdout)
    assert row["memory_bytes"] >= 12 * row["vertices"] + 16 * row["quads"]


def test_tables_are_text_csv_and_markdown(run):
    words = [*TORUS, "--methods", "dmc,dmc+simplify"]
    text = run(*words).stdout
    assert all(len(line) <= 130 for line in text.splitlines())
    assert "dmc+simplify" in text
    rows = list(csv.DictReader(io.StringIO(run(*words, "--format", "csv").stdout)))
    assert [row["method"] for row in rows] == ["dmc", "dmc+simplify"]
    assert int(rows[0]["quads"]) > int(rows[1]["quads"])
    lines = run(*words, "--format", "markdown").stdout.splitlines()
    assert lines[0].startswith("| method | vertices |")
    assert len({line.count("|") for line in lines[:4]}) == 1


@pytest.mark.parametrize("border", ["open", "closed"])
def test_the_border_is_that_of_all_methods(run, border):
    words = ["compare", "synth:iwp:16", "-i", 0.01, "--repeats", 1, "--format", "json", "--border", border]
    for row in json.loads(run(*words).stdout):
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
