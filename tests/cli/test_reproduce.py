"""`dmc reproduce`: printed and found figures side by side, as text and as JSON."""

import json

TABLE_8 = ("reproduce", "--table", "8", "--up-to", 64)


def test_paper_found_and_difference_stand_side_by_side(run):
    result = run(*TABLE_8)
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0] == "Table 8"
    assert lines[1].split() == ["data", "mesh", "quantity", "paper", "found", "difference"]
    assert ["genus_two_64", "dmc", "irregular_percent", "43.37"] in [line.split()[:4] for line in lines]
    assert len(lines) == 8


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
        is_placed = one["mesh"].startswith("dmc") and one["quantity"] != "irregular_percent"
        assert (one["found"] != other["found"]) == is_placed


def test_tables_that_are_not_there_are_refused(run):
    result = run("reproduce", "--table", "8,10")
    assert result.exit_code == 2
    assert "'10' is not one of 2, 3, 4, 5, 6, 7, 8, 9" in result.stderr
    assert run("reproduce", "--up-to", 0).exit_code == 2
