"""The papers' tables: printed figures, what is found, how both are shown."""

import csv
import json

import numpy as np
import pytest

from dmc_cli.contouring import extract_surface
from dmc_cli.field import upload_volume
from dmc_cli.reproduction import reproduce, reproduce_run
from dmc_cli.reproduction.paper_tables import DATA_SETS, PAPER_VALUES
from dmc_cli.reproduction.paper_values import DataSet, PaperValue
from dmc_cli.reproduction.reproduce import (
    Row,
    compare_tables,
    decimals,
    rows_as_json,
    rows_as_text,
)
from dmc_cli.reproduction.reproduce_run import measure_data_sets, reproduce_tables
from dmc_cli.reproduction.schmitz_table import SCANS
from dmc_cli.runtime.device import Device, select_device
from dmc_cli.settings import ReadSettings, ReproduceSettings, SurfaceSettings
from dmc_cli.volume_io.synthetic import synthetic_volume
from tests.conftest import ROOT

PRINTED = json.loads((ROOT / "tests/data/paper_tables.json").read_text("utf-8"))


def mismatches(rows):
    """The rows that were found and should equal the printed figure, to its digits, but do not."""
    return [
        row for row in rows if row.value.expectation == "exact" and row.found is not None and not row.agrees
    ]


@pytest.fixture(scope="module")
def found():
    """What was found on small data sets."""
    sets = [
        DataSet(field="genus_two", nodes=64),
        DataSet(field="iwp", nodes=32),
        DataSet(field="sphere", nodes=16),
    ]
    return measure_data_sets(select_device("cpu", 2), sets, "exact")


def printed(table, data, mesh, quantity):
    return next(
        v.printed
        for v in PAPER_VALUES
        if (v.table, v.data.name, v.mesh, v.quantity) == (table, data, mesh, quantity)
    )


def test_no_figure_stands_there_twice():
    keys = [(v.table, v.data, v.mesh, v.quantity) for v in PAPER_VALUES]
    assert len(set(keys)) == len(keys)
    assert {v.data for v in PAPER_VALUES} == {*DATA_SETS, *SCANS.values()}
    tables = [str(v.table) for v in PAPER_VALUES]
    assert tables == sorted(tables)


def test_every_figure_that_need_not_be_the_printed_one_says_why():
    for value in PAPER_VALUES:
        assert value.remark or value.expectation in ("exact", "close", "machine")


@pytest.mark.parametrize("name", ["iwp_512", "genus_two_256"])
def test_counts_and_times_are_the_printed_ones(name):
    counts = PRINTED["table_3_counts"][name]["paper"]
    assert printed(3, name, "dmc", "vertices") == counts["vertices"]
    assert printed(3, name, "dmc", "quads") == counts["quads"]
    assert printed(3, name, "dmc", "crossed_edges") == counts["mc_vertices"]
    removed = PRINTED["table_4_removed_quads"][name]["paper"]
    assert printed(4, name, "dmc_simplified", "removed_3x3y") == removed["3x3y"]
    assert printed(4, name, "dmc_simplified", "removed_3333") == removed["3333"]
    assert printed(2, name, "dmc", "surface_ms") == PRINTED["table_2_ms_rtx_2080_ti"]["dmc"][name]
    for quantity, row in (("halfedges_ms", "halfedges"), ("coloring_ms", "colouring")):
        assert printed(5, name, "dmc", quantity) == PRINTED["table_5_ms_rtx_2080_ti"][row][name]


@pytest.mark.parametrize("name", ["iwp_512", "genus_two_64", "genus_two_128", "genus_two_256"])
@pytest.mark.parametrize("mesh", ["dmc", "dmc_simplified"])
def test_qualities_are_the_printed_ones(name, mesh):
    table_7 = PRINTED["table_7_triangle_quality_mean_ratio"][name]["paper"]
    table_8 = PRINTED["table_8_quads"][name]["paper"]
    assert printed(7, name, mesh, "mean_ratio") == table_7[mesh]
    assert printed(8, name, mesh, "shape") == table_8["quality"][mesh]
    assert printed(8, name, mesh, "irregular_percent") == table_8["irregular_percent"][mesh]


@pytest.mark.parametrize("name", ["iwp_512", "genus_two_64", "genus_two_128", "genus_two_256"])
@pytest.mark.parametrize("mesh", ["mc", "tmc", "dc"])
def test_triangles_of_other_methods_are_the_printed_ones(name, mesh):
    table_7 = PRINTED["table_7_triangle_quality_mean_ratio"][name]["paper"]
    assert printed(7, name, mesh, "mean_ratio") == table_7[mesh]
    if mesh == "dc":
        assert printed(8, name, mesh, "shape") == PRINTED["table_8_quads"][name]["paper"]["quality"]["dc"]


@pytest.mark.parametrize("name", ["iwp_512", "genus_two_256"])
def test_counts_of_marching_cubes_are_the_printed_ones(name):
    counts = PRINTED["table_3_counts"][name]["paper"]
    assert printed(3, name, "mc", "vertices") == counts["mc_vertices"]
    assert printed(3, name, "mc", "triangles") == counts["mc_triangles"]
    assert printed(2, name, "mc", "surface_ms") == PRINTED["table_2_ms_rtx_2080_ti"]["mc"][name]


@pytest.mark.parametrize("name", ["kummer_256", "neovius_256", "steiner_512"])
def test_table_9_is_the_printed_one(name):
    counts = PRINTED["table_9_counts"][name]["paper"]
    assert printed(9, name, "dmc", "vertices") == counts["vertices"]
    assert printed(9, name, "dmc", "quads") == counts["quads"]


def test_the_rest_is_the_printed_one():
    deviation = PRINTED["table_6_mean_deviation_times_1e4"]["iwp_512"]["paper"]
    triangles = PRINTED["table_7_irregular_triangle_vertices_percent"]["genus_two"]["paper"]
    for mesh in ("dmc", "dmc_simplified"):
        assert printed(6, "iwp_512", mesh, "mean_deviation_1e4") == deviation[mesh]
    for nodes, percent in triangles.items():
        assert printed(7, f"genus_two_{nodes}", "dmc", "irregular_triangle_percent") == percent


def test_genus_two_64_is_irregular_as_printed(found):
    rows = compare_tables(found)
    rows_by = {
        (r.value.table, r.value.quantity): r for r in rows if r.found is not None and r.value.mesh == "dmc"
    }
    assert rows_by[8, "irregular_percent"].found == pytest.approx(43.37, abs=0.005)
    assert rows_by[6, "mean_deviation"].found == pytest.approx(1.5e-2, rel=0.1)
    assert rows_by[7, "mean_ratio"].found == pytest.approx(0.87, abs=0.015)
    assert mismatches(rows) == []


def test_counts_are_those_of_the_reference(found):
    with (ROOT / "tests/data/regression_counts.csv").open() as file:
        lines = [line for line in file if not line.startswith("#")]
    expected = {(r["field"], int(r["n"])): r for r in csv.DictReader(lines)}["genus_two", 64]
    for quantity in ("vertices", "quads", "crossed_edges"):
        assert found["genus_two_64", "dmc"][quantity] == int(expected[quantity])


def test_genus_two_64_is_simplified_as_printed(found):
    simplified = found["genus_two_64", "dmc_simplified"]
    assert (simplified["removed_3x3y"], simplified["removed_3333"]) == (865 + 68, 0)
    assert (simplified["vertices"], simplified["quads"]) == (8825, 8827)
    assert simplified["irregular_percent"] == pytest.approx(8.85, abs=0.005)


def test_times_are_taken(found):
    assert {name for name in found["iwp_32", "dmc"] if name.endswith("_ms")} == {
        "surface_ms",
        "halfedges_ms",
        "coloring_ms",
    }
    assert found["iwp_32", "dmc_simplified"]["simplify_ms"] > 0


def test_tables_and_sizes_are_chosen():
    rows = reproduce_tables(ReproduceSettings(table=("7", "8"), up_to=64, device="cpu"))
    assert {(row.value.table, row.value.data.name) for row in rows} == {
        (7, "genus_two_64"),
        (8, "genus_two_64"),
    }
    assert all(row.found is not None for row in rows)
    assert mismatches(rows) == []
    for row in rows:
        if row.value.expectation == "misprint":
            continue
        tolerance = 0.4 if row.value.quantity == "irregular_triangle_percent" else 0.0051
        assert row.found == pytest.approx(row.value.printed, abs=tolerance)


@pytest.mark.parametrize(
    ("settings", "tables", "largest"),
    [
        ({}, {2, 3, 4, 5, 6, 7, 8, 9, "I"}, 512),
        ({"up_to": 128}, {6, 7, 8}, 128),
        ({"table": ("3", "9")}, {3, 9}, 512),
    ],
)
def test_data_sets_of_the_chosen_rows_are_made_small_ones_first(monkeypatch, settings, tables, largest):
    made = []

    def measure(device, data_sets, placement, progress):
        made.extend(data_sets)
        return {}

    monkeypatch.setattr(reproduce_run, "measure_data_sets", measure)
    rows = reproduce_tables(ReproduceSettings(device="cpu", **settings))
    assert {row.value.table for row in rows} == tables
    assert {row.value.data for row in rows} == {*made, *(SCANS.values() if not settings else ())}
    assert len(set(made)) == len(made)
    sizes = [data.nodes for data in made]
    assert sizes == sorted(sizes)
    assert sizes[-1] == largest


def test_unused_vertices_count_as_irregular(found):
    assert found["iwp_32", "dmc"]["vertices"] == 23714
    assert found["iwp_32", "dmc"]["irregular_percent"] == pytest.approx(41.680, abs=5e-4)


def test_the_deviation_is_the_formulas(found):
    volume = synthetic_volume("synth:sphere:16", ReadSettings())
    surface = extract_surface(upload_volume(volume, Device("cpu", 2)), SurfaceSettings(isovalue=0.0))
    radii = np.linalg.norm(surface.mesh.positions.numpy().astype(float), axis=1)
    expected = np.abs(0.75 - radii).mean()
    assert found["sphere_16", "dmc"]["mean_deviation"] == pytest.approx(expected, rel=1e-4)
    assert found["sphere_16", "dmc"]["mean_deviation_1e4"] == pytest.approx(1e4 * expected, rel=1e-4)


def test_rows_show_both_figures_and_the_difference():
    found = {("genus_two_256", "dmc"): {"vertices": 158902, "quads": 158905, "irregular_percent": 42.2801}}
    rows = compare_tables(found)
    text = "\n".join(rows_as_text(rows))
    assert "Table 3\n" in text
    assert (
        "genus_two_256  dmc             quads                           158904       158905          +1"
        in text
    )
    assert "42.28      42.2801     +0.0001" in text
    assert [r.value.quantity for r in mismatches(rows)] == ["quads"]
    plain = rows_as_json(rows)
    assert len(plain) == len(PAPER_VALUES)
    assert (
        next(r for r in plain if r["quantity"] == "quads" and r["data"] == "genus_two_256")["difference"] == 1
    )
    assert json.loads(json.dumps(plain)) == plain


DATA = DataSet(field="iwp", nodes=512)


@pytest.mark.parametrize(
    ("printed", "found", "shown"),
    [
        (7, 9, "          7            9          +2"),
        (7, 4.0, "          7            4          -3"),
        (7, 7.5, "          7       7.5000     +0.5000"),
        (7.125, 7, "      7.125       7.0000     -0.1250"),
        (1.5e-5, 2.25e-5, "  1.500e-05    2.250e-05  +7.500e-06"),
        (7, None, "          7            -           -"),
        (7.0, None, "       7.00            -           -"),
    ],
)
def test_figures_in_their_columns(printed, found, shown):
    row = Row(value=PaperValue(3, DATA, "dmc", "quads", printed, "exact"), found=found)
    heading, names, line = rows_as_text([row])
    assert heading == "Table 3"
    assert names.split() == ["data", "mesh", "quantity", "paper", "found", "difference", "reason"]
    assert line.rpartition("  ")[0] == "  iwp_512        dmc             quads                      " + shown
    assert names.index("  reason") == line.rindex("  ")


@pytest.mark.parametrize(
    ("expectation", "remark", "found", "reason"),
    [
        ("exact", "by hand", 7, "same"),
        ("exact", "", 8, "not explained"),
        ("close", "ties", 8, "ties"),
        ("close", "ties", None, "not made"),
        ("machine", "", 7, "a time, theirs on an RTX 2080 Ti"),
        ("misprint", "as table 4 says", 8, "as table 4 says"),
    ],
)
def test_the_reason_of_a_difference_stands_behind_it(expectation, remark, found, reason):
    row = Row(value=PaperValue(3, DATA, "dmc", "quads", 7, expectation, remark), found=found)
    assert list(rows_as_text([row]))[2].endswith("  " + reason)
    assert rows_as_json([row])[0]["reason"] == reason


def test_a_scan_that_is_not_there_is_asked_for():
    row = Row(value=PaperValue("I", SCANS["stent"], "mc", "triangles", 7, "other_data", "crop"), found=None)
    heading, _, line = rows_as_text([row])
    assert heading == "Table I of Schmitz et al. 2009"
    assert line.endswith("no scan: --scan stent=FILE")


def test_figures_agree_to_the_digits_that_are_printed():
    assert [decimals(printed) for printed in (7, 0.7, 0.84, 0.700012, 1.525e-5)] == [0, 2, 2, 6, 8]
    value = PaperValue(3, DATA, "dmc", "shape", 0.84, "exact")
    assert Row(value=value, found=0.8449).agrees
    assert not Row(value=value, found=0.8451).agrees
    assert not Row(value=value, found=None).agrees


def test_every_table_has_one_heading():
    rows = [Row(value=PaperValue(t, DATA, "dmc", "quads", 7, "exact"), found=None) for t in (3, 3, 4, 9, 9)]
    assert [line for line in rows_as_text(rows) if line.startswith("Table")] == [
        "Table 3",
        "Table 4",
        "Table 9",
    ]
    assert len(list(rows_as_text(rows))) == 5 + 2 * 3


def test_the_pieces_of_the_mean_deviation_do_not_show(monkeypatch, found):
    sets = [DataSet(field="sphere", nodes=16)]
    monkeypatch.setattr(reproduce, "CHUNK", 100)
    again = measure_data_sets(select_device("cpu", 2), sets, "exact")["sphere_16", "dmc"]
    for quantity in ("mean_deviation", "mean_deviation_1e4"):
        assert again[quantity] == pytest.approx(found["sphere_16", "dmc"][quantity], rel=1e-12)
