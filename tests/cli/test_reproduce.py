"""`dmc reproduce`: printed and found figures side by side, as text and as JSON."""

import json

import numpy as np
import pytest

TABLE_8 = ("reproduce", "--table", "8", "--up-to", 64)


def test_paper_found_and_difference_stand_side_by_side(run):
    result = run(*TABLE_8)
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0] == "Table 8"
    assert lines[1].split() == ["data", "mesh", "quantity", "paper", "found", "difference", "reason"]
    assert ["genus_two_64", "dmc", "irregular_percent", "43.37"] in [line.split()[:4] for line in lines]
    assert len(lines) == 2 + 9
    assert all(line.endswith("  same") for line in lines[2:])


def test_json_holds_the_same_rows(run):
    rows = json.loads(run(*TABLE_8, "--json").stdout)
    found = {(row["mesh"], row["quantity"]): row for row in rows}
    assert found["dmc", "irregular_percent"]["paper"] == 43.37
    assert round(found["dmc", "irregular_percent"]["found"], 2) == 43.37
    assert round(found["dmc_simplified", "irregular_percent"]["found"], 2) == 8.85
    assert all(row["table"] == 8 for row in rows)
    assert all(row["difference"] == row["found"] - row["paper"] for row in rows)


def test_placement_changes_shapes_and_not_counts(run):
    exact = json.loads(run(*TABLE_8, "--placement", "exact", "--json").stdout)
    sampled = json.loads(run(*TABLE_8, "--json").stdout)
    for one, other in zip(exact, sampled, strict=True):
        is_placed = one["mesh"].startswith("dmc") and one["quantity"] == "shape"
        assert (one["found"] != other["found"]) == is_placed


def test_tables_that_are_not_there_are_refused(run):
    result = run("reproduce", "--table", "8,10")
    assert result.exit_code == 2
    assert "'10' is not one of 2, 3, 4, 5, 6, 7, 8, 9" in result.stderr
    assert run("reproduce", "--up-to", 0).exit_code == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["engine.nii"], "expected NAME=FILE, NAME one of backpack, bonsai, engine, stent"),
        (["skull=a.nii"], "expected NAME=FILE"),
        (["engine="], "expected NAME=FILE"),
        (["engine=a.nii", "engine=b.nii"], "scan engine is given twice"),
    ],
)
def test_scans_are_named(run, words, message):
    result = run("reproduce", "--table", "I", *[part for word in words for part in ("--scan", word)])
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert run("reproduce", "--table", "I", "--scan", "engine=not/there.nii").exit_code == 3


def test_table_i_is_made_of_the_scans_that_there_are(run, tmp_path):
    write_scan(tmp_path / "engine.npy")
    words = ["reproduce", "--table", "I", "--scan", f"engine={tmp_path / 'engine.npy'}", "--json"]
    rows = json.loads(run(*words).stdout)
    found = {(row["data"], row["mesh"], row["quantity"]): row for row in rows}
    triangles = found["engine", "mc", "triangles"]
    assert (triangles["found"], triangles["same"]) == (8, False)
    assert "copies" in triangles["reason"]
    assert found["engine", "mc", "radius_ratio_min"]["found"] == pytest.approx(1, abs=0.2)
    assert found["engine", "dc_particle", "triangles"]["found"] == 12
    assert found["stent", "mc", "triangles"]["reason"] == "no scan: --scan stent=FILE"
    assert {row["data"] for row in rows if row["found"] is not None} == {"engine"}


def write_scan(path):
    """One node inside: an octahedron by marching cubes, a cube of six quads by dual contouring."""
    values = np.zeros((5, 5, 5), np.uint8)
    values[2, 2, 2] = 99
    np.save(path, values)


def test_the_papers_figures_are_drawn_of_the_largest_data_set(run, tmp_path):
    for folder in ("a", "b"):
        words = ["--table", "8", "--up-to", 64, "--figures", tmp_path / folder]
        assert run("reproduce", *words).exit_code == 0
    names = {
        f"figure_{name}_genus_two_64" for name in ("2020_10", "2020_11", "2021_11", "2021_14", "2021_15")
    }
    drawn = sorted((tmp_path / "a").iterdir())
    assert {path.stem for path in drawn} == names
    assert {path.suffix for path in drawn} == {".svg", ".png"}
    for path in drawn:
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    text = (tmp_path / "a" / "figure_2021_14_genus_two_64.svg").read_text()
    assert all(f">{name}<" in text for name in ("DC", "DMC", "DMCS"))
    (tmp_path / "file").write_text("")
    assert run("reproduce", *words[:-1], tmp_path / "file").exit_code == 2


def test_what_no_data_set_is_small_enough_for_is_refused(run):
    result = run("reproduce", "--table", "8", "--up-to", 10)
    assert result.exit_code == 2
    assert "the smallest data set of what is asked for has 64 nodes" in " ".join(result.stderr.split())


def test_figures_of_a_table_without_any_are_refused(run, tmp_path):
    result = run("reproduce", "--table", "I", "--figures", tmp_path / "figures")
    assert result.exit_code == 2
    assert "none of the data sets that they show is made" in " ".join(result.stderr.split())
    assert not (tmp_path / "figures").exists()
