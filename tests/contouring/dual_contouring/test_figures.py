"""The figures of the paper of 2021 and of an independent implementation, to the digits that they have."""

import numpy as np
import pytest

from dmc_cli.contouring import connect_faces
from dmc_cli.report.measures import measure_quality
from tests.contouring.dual_grid.deviation import deviations
from tests.contouring.dual_grid.splitting import irregular_triangle_percent, split_by_angle
from tests.fields import paper_field
from tests.oracle.edges import pair_valences

PLACEMENTS = {
    "nets": {"method": "nets"},
    "paper": {"method": "dc", "placement": "paper"},
    "qef": {"method": "dc"},
    **{f"{n} steps": {"method": "dc", "placement": "particle", "steps": n} for n in (10, 20, 50)},
}

SHAPES = [
    ("genus_two", 64, "nets", 0.86521, 0.87354, 1.395177e-02, 4.636112e-02, None),
    ("genus_two", 64, "paper", 0.73076, 0.83597, 1.043659e-02, 4.636112e-02, 47.80),
    ("genus_two", 64, "qef", 0.85553, 0.87351, 7.183304e-03, 3.719076e-02, 0.61),
    ("genus_two", 64, "10 steps", 0.86372, 0.87364, 6.982708e-03, 3.446163e-02, 0.0),
    ("genus_two", 64, "20 steps", 0.86355, 0.87376, 7.159374e-03, 3.748906e-02, 0.0),
    ("genus_two", 64, "50 steps", 0.86288, 0.87395, 7.181405e-03, 3.721795e-02, 0.0),
    ("genus_two", 128, "paper", 0.73405, 0.83803, 2.565397e-03, 1.169017e-02, 45.56),
    ("genus_two", 128, "qef", 0.86521, 0.87408, 1.810761e-03, 1.002843e-02, 0.14),
    ("genus_two", 128, "20 steps", 0.86666, 0.87451, 1.804399e-03, 9.767553e-03, 0.0),
]
"""Mean quality of quads (equation 9), of triangles, mean and largest |f|, percent outside or fallen back."""


@pytest.mark.parametrize(("field", "nodes", "name", *("shape", "ratio", "mean", "most", "share")), SHAPES)
def test_shapes_and_deviations(extract, field, nodes, name, shape, ratio, mean, most, share):
    surface = extract(paper_field(field, nodes), threads=2, **PLACEMENTS[name])
    quality = measure_quality(surface.mesh)
    assert round(quality.shape_mean, 5) == pytest.approx(shape, abs=1.01e-5)
    assert round(quality.mean_ratio_mean, 5) == pytest.approx(ratio, abs=1.01e-5)
    found = deviations(extract, field, nodes, **PLACEMENTS[name])
    assert found.mean() == pytest.approx(mean, rel=1e-5)
    assert found.max() == pytest.approx(most, rel=1e-4)
    if share is not None:
        assert round(100 * surface.counts.fallback_vertices / len(found), 2) == share


def irregular_quad_percent(surface):
    valence = pair_valences(surface.mesh.faces.numpy(), surface.mesh.vertex_count)
    return 100.0 * (1.0 - np.count_nonzero(valence == 4) / surface.counts.active_cells)


@pytest.mark.parametrize(
    ("field", "nodes", "expected"),
    [
        ("genus_two", 64, 43.370),
        ("genus_two", 128, 42.598),
        pytest.param("genus_two", 256, 42.283, marks=pytest.mark.slow),
        ("iwp", 128, 27.842),
        pytest.param("iwp", 512, 23.495, marks=pytest.mark.slow),
    ],
)
def test_irregular_vertices_of_table_8(extract, field, nodes, expected):
    surface = extract(paper_field.__wrapped__(field, nodes), method="dc", threads=2)
    assert round(irregular_quad_percent(surface), 3) == expected


@pytest.mark.parametrize(
    ("nodes", "printed"), [(128, 36.71), pytest.param(256, 34.40, marks=pytest.mark.slow)]
)
def test_irregular_vertices_of_table_7(extract, nodes, printed):
    surface = extract(paper_field.__wrapped__("genus_two", nodes), threads=2, **PLACEMENTS["paper"])
    placement = surface.placement
    index = np.stack(placement.frame.grid.lowest_nodes(placement.cell.numpy()), axis=1)
    points = index + placement.local.numpy().astype(np.float64)
    triangles = split_by_angle(points, surface.mesh.faces.numpy().reshape(-1, 4))
    assert round(irregular_triangle_percent(triangles, len(points)), 2) == printed


@pytest.mark.slow
def test_the_mean_deviation_of_table_6(extract):
    found = deviations(extract, "iwp", 512, **PLACEMENTS["paper"])
    assert round(1e4 * float(found.mean()), 2) == 3.44


def test_a_surface_is_connected_and_colored(extract):
    surface = connect_faces(extract(paper_field("genus_two", 32), method="dc"))
    assert surface.mesh.halfedges is not None
