"""The counts of the reference tables are exact, and so are the papers' shares of irregular vertices."""

import numpy as np
import pytest

from tests.contouring.methods_counts import row_name, rows, scans, volume_of_row
from tests.fields import paper_field, smooth_noise, white_noise
from tests.oracle.edges import pair_use
from tests.triangles import euler_characteristic, triangle_valences

IRREGULAR = {("genus_two", 64): 46.15, ("genus_two", 128): 45.03}
LARGE_IRREGULAR = {("genus_two", 256): 44.13, ("iwp", 512): 25.13}
"""Percent of vertices that do not have six triangles (Grosso & Zint 2021, table 7), by the standard table."""


def assert_counts(surface, row):
    faces = surface.mesh.faces.numpy()
    assert len(surface.placement.cell) == int(row["mc_vertices"])
    assert len(faces) == int(row["mc_triangles_separate"])
    assert surface.counts.active_cells == int(row["active_cells"])
    assert surface.counts.crossed_edges == int(row["mc_vertices"])
    assert euler_characteristic(faces) == int(row["euler_mc_separate"])


@pytest.mark.parametrize("row", rows(largest=128), ids=row_name)
def test_the_counts_of_the_papers_fields_are_exact(extract, row):
    assert_counts(extract(volume_of_row(row), float(row["isovalue"]), method="mc", threads=2), row)


@pytest.mark.slow
@pytest.mark.parametrize("row", rows(smallest=256), ids=row_name)
def test_the_counts_of_the_papers_large_fields_are_exact(extract, row):
    assert_counts(extract(volume_of_row(row), float(row["isovalue"]), method="mc", threads=2), row)


@pytest.mark.real
@pytest.mark.parametrize("row", scans())
def test_the_counts_of_real_volumes_are_exact(extract, row, shared_data):
    volume = volume_of_row(row, shared_data)
    surface = extract(volume, float(row["isovalue"]), method="mc", border=row["border"], threads=2)
    assert_counts(surface, row)


def irregular_percent(surface):
    return 100.0 * float(np.mean(triangle_valences(surface.mesh.faces.numpy()) != 6))


@pytest.mark.parametrize(("field", "nodes"), IRREGULAR)
def test_the_papers_shares_of_irregular_vertices_are_those_of_the_standard_table(extract, field, nodes):
    surface = extract(paper_field(field, nodes), method="mc", triangulation="standard")
    assert round(irregular_percent(surface), 2) == IRREGULAR[field, nodes]


@pytest.mark.slow
@pytest.mark.parametrize(("field", "nodes"), LARGE_IRREGULAR)
def test_the_papers_shares_of_large_fields_are_those_of_the_standard_table(extract, field, nodes):
    volume = paper_field.__wrapped__(field, nodes)
    surface = extract(volume, method="mc", triangulation="standard", threads=2)
    assert round(irregular_percent(surface), 2) == LARGE_IRREGULAR[field, nodes]


@pytest.mark.parametrize("make", [lambda: white_noise(20), lambda: smooth_noise(24), lambda: white_noise(9)])
@pytest.mark.parametrize("triangulation", ["best", "standard"])
def test_scikit_image_has_the_same_counts(extract, make, triangulation):
    marching_cubes = pytest.importorskip("skimage.measure").marching_cubes
    volume = make()
    points, faces, *_ = marching_cubes(volume.values.copy(), 0.0, method="lorensen")
    surface = extract(volume, method="mc", triangulation=triangulation)
    found = surface.mesh.faces.numpy()
    assert (len(surface.placement.cell), len(found)) == (len(points), len(faces))
    assert euler_characteristic(found) == euler_characteristic(
        np.pad(faces, ((0, 0), (0, 1)), constant_values=-1)
    )
    assert pair_use(found[:, :3]).max() == 2
    ours = np.sort(surface.mesh.positions.numpy().astype(float).round(4), axis=0)
    np.testing.assert_allclose(ours, np.sort(points[:, ::-1].astype(float).round(4), axis=0), atol=2e-4)
