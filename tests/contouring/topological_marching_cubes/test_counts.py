"""The counts of the reference tables are exact: cells, random volumes, the papers' fields, real volumes."""

import re

import numpy as np
import pytest

from tests.contouring.methods_counts import row_name, rows, scans, volume_of_row
from tests.fields import paper_field, volume_of
from tests.oracle.edges import pair_use
from tests.reference import table
from tests.triangles import euler_characteristic, triangle_valences

SINGULAR = {("iwp", "0")}
"""At this isovalue the interpolant itself is singular: rounding decides on its thousand tiny tunnels."""


def assert_counts(surface, row):
    faces = surface.mesh.faces.numpy()
    assert pair_use(faces[:, :3]).max() == 2
    assert surface.counts.active_cells == int(row["active_cells"])
    assert euler_characteristic(faces) == int(row["euler_trilinear"])
    assert surface.counts.tunnel_cells == int(row["tunnel_cells"])
    assert surface.counts.multi_polygon_cells == int(row["cells_with_2_or_more_polygons"])
    assert len(surface.placement.cell) - surface.counts.crossed_edges == int(row["tmc_inner_vertices"])
    assert len(surface.placement.cell) == int(row["tmc_vertices"])
    assert len(faces) == int(row["tmc_triangles"])


def regular(found):
    return [row for row in found if (row["volume"], row["isovalue"]) not in SINGULAR]


@pytest.mark.parametrize("row", regular(rows(largest=128)), ids=row_name)
def test_the_counts_of_the_papers_fields_are_exact(extract, row):
    assert_counts(extract(volume_of_row(row), float(row["isovalue"]), method="tmc", threads=2), row)


@pytest.mark.slow
@pytest.mark.parametrize("row", regular(rows(smallest=256)), ids=row_name)
def test_the_counts_of_the_papers_large_fields_are_exact(extract, row):
    assert_counts(extract(volume_of_row(row), float(row["isovalue"]), method="tmc", threads=2), row)


def is_between_values(row):
    """Whether no node has the isovalue: the volume has whole numbers, or is of real ones."""
    return "." in row["isovalue"] or row["volume"] == "fetal"


@pytest.mark.real
@pytest.mark.parametrize("row", [scan for scan in scans() if is_between_values(*scan.values)])
def test_the_counts_of_real_volumes_are_exact(extract, row, shared_data):
    """Where products are tied, the number of inner vertices depends on how degenerate roots are taken."""
    volume = volume_of_row(row, shared_data)
    surface = extract(volume, float(row["isovalue"]), method="tmc", border=row["border"], threads=2)
    if int(row["tie_cells"]) == 0:
        assert_counts(surface, row)
        return
    faces = surface.mesh.faces.numpy()
    assert pair_use(faces[:, :3]).max() == 2
    assert euler_characteristic(faces) == int(row["euler_trilinear"])
    assert surface.counts.tunnel_cells == int(row["tunnel_cells"])


@pytest.mark.parametrize("triangulation", ["best", "standard"])
def test_every_case_of_a_single_cell_has_the_topology_of_the_interpolant(extract, triangulation):
    for row in table("mc33_cells.csv"):
        values = np.array([float(row[f"f{c}"]) for c in range(8)]).reshape(2, 2, 2)
        surface = extract(volume_of(values), method="tmc", triangulation=triangulation)
        faces = surface.mesh.faces.numpy()
        inner = len(surface.placement.cell) - surface.counts.crossed_edges
        found = (euler_characteristic(faces), surface.counts.tunnel_cells, inner, len(faces))
        names = ("euler", "tunnel", "tmc_inner_vertices", "tmc_triangles")
        assert found == tuple(int(row[name]) for name in names), row
        assert pair_use(faces[:, :3]).max(initial=0) <= 2
        assert surface.counts.polygons == len(re.findall(r"\d+", row["polygons"]))


def random_volume(row):
    n = int(row["n"])
    values = np.random.default_rng(int(row["seed"])).uniform(-1, 1, (n, n, n)).astype(np.float32)
    return volume_of(np.pad(values, 1, constant_values=-1) if row["border"] == "closed" else values)


def test_random_volumes_have_the_topology_of_the_interpolant(extract):
    for row in table("betti_random.csv"):
        surface = extract(random_volume(row), method="tmc")
        faces = surface.mesh.faces.numpy()
        assert euler_characteristic(faces) == int(row["euler"]), row
        assert surface.counts.tunnel_cells == int(row["tunnel_cells"]), row
        assert pair_use(faces[:, :3]).max(initial=0) <= 2


@pytest.mark.slow
def test_the_papers_share_of_irregular_vertices_is_that_of_the_standard_table(extract):
    surface = extract(paper_field.__wrapped__("iwp", 512), method="tmc", triangulation="standard", threads=2)
    irregular = 100 * np.mean(triangle_valences(surface.mesh.faces.numpy()) != 6)
    assert round(float(irregular), 2) == 25.17
