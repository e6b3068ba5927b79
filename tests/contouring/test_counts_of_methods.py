"""The counts of `methods_counts.csv` are those of every method of the registry, volume by volume."""

from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.methods import METHODS
from tests.contouring.methods_counts import row_name, rows, volume_of_row
from tests.oracle.edges import pair_use, pinched_vertices, vertex_pairs
from tests.triangles import euler_characteristic

SINGULAR = {("iwp", "0")}
"""Where rounding decides on tiny tunnels; the thousand of 512 nodes lie where no face is ambiguous."""


def of_edges(surface, row, euler):
    """What meshes with vertices on edges have."""
    faces = surface.mesh.faces.numpy()
    assert surface.counts.crossed_edges == int(row["mc_vertices"])
    assert euler_characteristic(faces) == int(row[euler])
    assert pair_use(faces[:, :3]).max() == 2
    # each segment of the volume's border is one side of a triangle
    assert np.count_nonzero(pair_use(faces[:, :3]) == 1) == int(row["boundary_segments"])


def assert_mc(surface, row):
    of_edges(surface, row, "euler_mc_separate")
    assert len(surface.placement.cell) == int(row["mc_vertices"])
    assert len(surface.mesh.faces) == int(row["mc_triangles_separate"])


def assert_tmc(surface, row):
    of_edges(surface, row, "euler_trilinear")
    counts = surface.counts
    assert counts.tunnel_cells == int(row["tunnel_cells"])
    if int(row["tie_cells"]) == 0:
        assert len(surface.placement.cell) == int(row["tmc_vertices"])
        assert len(surface.mesh.faces) == int(row["tmc_triangles"])


def is_no_disc(quads, count):
    """Whether a vertex has several fans, or a side that four quads share, shape (count,)."""
    pairs, uses = np.unique(vertex_pairs(quads), return_counts=True)
    found, size = pinched_vertices(quads, count), int(quads.max()) + 1
    found[pairs[uses > 2] // size] = found[pairs[uses > 2] % size] = True
    return found


def assert_dual(surface, row):
    counts, use = surface.counts, pair_use(surface.mesh.faces.numpy())
    assert surface.mesh.vertex_count == int(row["active_cells"]) - counts.unused_vertices
    assert surface.mesh.face_count == int(row["inner_crossed_edges"])
    assert counts.crossed_edges == int(row["mc_vertices"])
    assert np.count_nonzero(use == 4) == int(row["dc_edges_with_4_quads"])
    assert np.count_nonzero(use == 3) == int(row["dc_edges_with_3_quads"])
    assert use.max() <= 4
    if int(row["boundary_segments"]) == 0:  # at the border the table counts cells, not fans
        found = is_no_disc(surface.mesh.faces.numpy(), surface.mesh.vertex_count)
        assert found.sum() == int(row["dc_nonmanifold_vertices"])


def assert_dmc(surface, row):
    counts = surface.counts
    assert counts.polygons == int(row["dmc_vertices"])
    assert surface.mesh.face_count == int(row["inner_crossed_edges"])
    assert counts.crossed_edges == int(row["mc_vertices"])
    assert counts.multi_polygon_cells == int(row["cells_with_2_or_more_polygons"])


EXPECTED = {
    "dmc": assert_dmc,
    "mc": assert_mc,
    "tmc": assert_tmc,
    "nets": assert_dual,
    "dc": assert_dual,
    "macet": assert_mc,
}


def assert_counts(extract, row, volume, method):
    chosen = {"topology": "asymptotic"} if method == "dmc" else {}
    isovalue, border = float(row["isovalue"]), row["border"]
    surface = extract(volume, isovalue, method=method, border=border, threads=2, **chosen)
    assert surface.counts.active_cells == int(row["active_cells"])
    EXPECTED[method](surface, row)


def regular(found, method):
    """Rows without those where the interpolant is singular, for the method that would have to decide."""
    return [row for row in found if method != "tmc" or (row["volume"], row["isovalue"]) not in SINGULAR]


def pairs(found):
    return [
        pytest.param(method, row, id=f"{method}-{row_name(row)}")
        for method in METHODS
        for row in regular(found, method)
    ]


@pytest.mark.parametrize(("method", "row"), pairs(rows(largest=64)))
def test_small_fields(extract, method, row):
    assert_counts(extract, row, volume_of_row(row), method)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "row"), pairs(rows(smallest=128)))
def test_large_fields(extract, method, row):
    assert_counts(extract, row, volume_of_row(row), method)


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.parametrize(("method", "row"), pairs(rows(real=True)))
def test_scans(extract, shared_data, method, row):
    """Whole numbers are cut half below one of them; the table's rows at one are of real numbers."""
    volume = volume_of_row(row, shared_data)
    if float(row["isovalue"]).is_integer() and row["volume"] != "fetal":
        volume = replace(volume, values=volume.values.astype(np.float32))
    assert_counts(extract, row, volume, method)
