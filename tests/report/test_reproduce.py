"""The papers' tables: printed figures, what is found, how both are shown."""

import csv
import json

import numpy as np
import pytest

from dmc_cli.device import Device
from dmc_cli.report.paper_tables import DATA_SETS, PAPER_VALUES, DataSet
from dmc_cli.report.reproduce import (
    SyntheticMesh,
    compare_tables,
    mean_field_value,
    measure_synthetic,
    mismatches,
    rows_as_json,
    rows_as_text,
)
from dmc_cli.report.twins import find_twins
from dmc_cli.settings import ReadSettings, SurfaceSettings
from dmc_cli.surface import extract_surface, upload_volume
from dmc_cli.volume.synthetic import synthetic_volume
from tests.conftest import ROOT

PRINTED = json.loads((ROOT / "tests/data/paper_tables.json").read_text())


def synthetic_mesh(field, nodes, device):
    volume = synthetic_volume(f"synth:{field}:{nodes}", ReadSettings())
    settings = SurfaceSettings(isovalue=0.0, topology="asymptotic")
    surface = extract_surface(upload_volume(volume, device), settings)
    mesh = SyntheticMesh(
        data=DataSet(field=field, nodes=nodes),
        points=surface.vertices,
        cells=surface.vertex_cell.numpy(),
        locals=surface.vertex_local.numpy(),
        quads=surface.quads,
        twins=find_twins(device, surface.quads, surface.vertices.shape[0]),
        unused_vertices=surface.counts.unused_vertices,
    )
    return mesh, surface


def printed(table, data, mesh, quantity):
    return next(
        v.printed
        for v in PAPER_VALUES
        if (v.table, v.data.name, v.mesh, v.quantity) == (table, data, mesh, quantity)
    )


def test_no_figure_stands_there_twice():
    keys = [(v.table, v.data, v.mesh, v.quantity) for v in PAPER_VALUES]
    assert len(set(keys)) == len(keys)
    assert {v.data for v in PAPER_VALUES} == set(DATA_SETS)
    assert [v.table for v in PAPER_VALUES] == sorted(v.table for v in PAPER_VALUES)


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


@pytest.fixture(scope="module")
def genus_two():
    device = Device("cpu", 2)
    mesh, surface = synthetic_mesh("genus_two", 64, device)
    return measure_synthetic(device, mesh) | {"crossed_edges": surface.counts.crossed_edges}


def test_genus_two_64_is_irregular_as_printed(genus_two):
    rows = compare_tables({("genus_two_64", "dmc"): genus_two})
    found = {(r.value.table, r.value.quantity): r for r in rows if r.found is not None}
    assert found[8, "irregular_percent"].found == pytest.approx(43.37, abs=0.005)
    assert found[6, "mean_deviation"].found == pytest.approx(1.5e-2, rel=0.1)
    assert found[7, "mean_ratio"].found == pytest.approx(0.87, abs=0.015)
    assert mismatches(rows) == []


def test_counts_are_those_of_the_reference(genus_two):
    with (ROOT / "tests/data/regression_counts.csv").open() as file:
        lines = [line for line in file if not line.startswith("#")]
    expected = {(r["field"], int(r["n"])): r for r in csv.DictReader(lines)}["genus_two", 64]
    assert genus_two["vertices"] == int(expected["vertices"])
    assert genus_two["quads"] == int(expected["quads"])
    assert genus_two["crossed_edges"] == int(expected["crossed_edges"])


def test_unused_vertices_count_as_irregular():
    device = Device("cpu", 2)
    found = measure_synthetic(device, synthetic_mesh("iwp", 32, device)[0])
    assert found["vertices"] == 23714
    assert found["irregular_percent"] == pytest.approx(41.680, abs=5e-4)


def test_the_deviation_is_the_formulas():
    mesh, surface = synthetic_mesh("sphere", 16, Device("cpu", 2))
    radii = np.linalg.norm(surface.vertices.numpy().astype(float), axis=1)
    assert mean_field_value(mesh) == pytest.approx(np.abs(0.75 - radii).mean(), rel=1e-4)


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
