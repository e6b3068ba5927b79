"""The oracle's surfaces of small volumes with known answers, and the reference counts."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from tests.fields import (
    NON_MANIFOLD_ISOVALUES,
    non_manifold_volume,
    one_inside_node,
    paper_field,
    plane,
    touching_nodes,
    volume_of,
    white_noise,
)
from tests.oracle.edges import edge_use, pinched_vertex_count, pinched_vertices
from tests.oracle.faces import joins_inside
from tests.oracle.quads import polygon_fans
from tests.oracle.surface import extract_oracle_surface
from tests.reference import rows_of_size

NON_MANIFOLD_COUNTS = {
    "1-Edge": (35, 26, 1, 0),
    "2-Edge": (31, 20, 2, 0),
    "3-Edge": (40, 28, 3, 0),
    "4-Edge": (46, 33, 6, 1),
    "12-Merge-iso-241.525": (93, 76, 6, 0),
    "Iterative-Fix": (83, 63, 7, 0),
    "Non-Manifold-Vertex": (17, 9, 0, 0),
}


def extract(volume, isovalue=0.0, **settings):
    return extract_oracle_surface(volume, SurfaceSettings(isovalue=isovalue, **settings))


def normals(surface):
    """Normals of the quads with every vertex at the middle of its cell."""
    vertices, quads = surface.indexed_quads()
    p = np.array([v.cell for v in vertices])[quads]
    return np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])


@pytest.mark.parametrize(
    ("distances", "joined"),
    [
        ((2, -1, -1, 2), True),
        ((1, -2, -2, 1), False),
        ((1, -1, -1, 1), True),
        ((-1, 2, 2, -1), True),
        ((-2, 1, 1, -2), False),
        ((-1, 1, 1, -1), True),
        ((3, -1, -2, 0.5), False),
    ],
)
def test_an_ambiguous_face_joins_when_the_inside_product_is_not_smaller(distances, joined):
    assert joins_inside(*distances) is joined


def test_one_inside_node_makes_a_box_of_six_quads():
    vertices, quads = extract(one_inside_node()).indexed_quads()
    assert (len(vertices), len(quads)) == (8, 6)


def test_outward_normals_point_out_of_the_box():
    surface = extract(one_inside_node())
    centres = np.array([np.mean([v.cell for v in vertices], axis=0) for _, vertices in surface.quads])
    assert (np.sum(normals(surface) * (centres - 1.5), axis=1) > 0).all()


def test_a_plane_at_an_open_border_has_a_quad_round_every_inner_edge():
    surface = extract(plane(nodes=6))
    assert len(surface.quads) == 16
    assert surface.crossed_edge_count == 36
    assert surface.polygon_count == 25


@pytest.mark.parametrize(
    ("settings", "sign"),
    [
        ({}, 1),
        ({"orientation": "gradient"}, -1),
        ({"inside": "below"}, -1),
        ({"inside": "below", "orientation": "gradient"}, -1),
    ],
)
def test_the_normals_of_a_plane_with_low_values_above_follow_the_settings(settings, sign):
    assert (np.sign(normals(extract(plane(), **settings))[:, 2]) == sign).all()


def test_a_mirroring_affine_reverses_the_quads():
    values = plane().values
    affine = np.diag([-1.0, 1.0, 1.0, 1.0])
    plain = extract(volume_of(values))
    mirrored = extract(volume_of(values, affine=affine))
    assert [corners[::-1] for _, corners in plain.quads] == [corners for _, corners in mirrored.quads]


def test_quads_are_in_the_order_of_words_axes_and_nodes():
    edges = [edge for edge, _ in extract(white_noise(6)).quads]
    assert edges == sorted(edges, key=lambda e: (e[3], e[2], e[1] // 32, e[0], e[1]))


@pytest.mark.parametrize(("isovalue", "most"), [(-0.5, 4), (0.5, 2)], ids=["joined", "separated"])
def test_two_nodes_touching_across_a_face_share_an_edge_of_four_quads_when_joined(isovalue, most):
    surface = extract(touching_nodes(), isovalue=isovalue, topology="asymptotic")
    assert list(surface.decisions.values()) == [most == 4]
    assert edge_use(surface).max() == most


@pytest.mark.parametrize(
    ("with_quad", "fans"),
    [
        ({0, 1, 2, 3}, [{0, 1, 2, 3}]),
        ({0, 1, 3}, [{3, 0, 1}]),
        ({0, 2}, [{2}, {0}]),
        ({1, 2}, [{1, 2}]),
        (set(), []),
    ],
)
def test_fans_are_the_runs_of_polygon_edges_with_quads(with_quad, fans):
    assert polygon_fans((0, 1, 2, 3), with_quad) == [frozenset(fan) for fan in fans]


@pytest.mark.parametrize("row", rows_of_size(32), ids=lambda row: f"{row['field']}-{row['n']}")
def test_the_counts_of_the_papers_fields_are_exact(row):
    surface = extract(paper_field(row["field"], int(row["n"])), topology="asymptotic")
    use = edge_use(surface)
    found = {
        "vertices": surface.polygon_count,
        "unused": surface.unused_count,
        "quads": len(surface.quads),
        "crossed_edges": surface.crossed_edge_count,
        "boundary_edges": int((use == 1).sum()),
        "edges_with_4_quads": int((use == 4).sum()),
    }
    assert found == {key: int(row[key]) for key in found}


@pytest.mark.parametrize("name", NON_MANIFOLD_ISOVALUES)
def test_the_counts_of_the_non_manifold_volumes_are_exact(name):
    volume, isovalue = non_manifold_volume(name), NON_MANIFOLD_ISOVALUES[name]
    surface = extract(volume, isovalue, topology="asymptotic")
    use = edge_use(surface)
    found = (surface.polygon_count, len(surface.quads), int((use == 4).sum()), int((use == 3).sum()))
    assert found == NON_MANIFOLD_COUNTS[name]


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("name", NON_MANIFOLD_ISOVALUES)
def test_the_non_manifold_volumes_become_manifold(name, border):
    surface = extract(non_manifold_volume(name), NON_MANIFOLD_ISOVALUES[name], border=border)
    assert edge_use(surface).max() <= 2
    assert pinched_vertex_count(surface) == 0


@pytest.mark.parametrize("border", ["open", "closed"])
def test_white_noise_becomes_manifold(border):
    surface = extract(white_noise(14), border=border)
    assert edge_use(surface).max() <= 2
    assert pinched_vertex_count(surface) == 0


def test_flips_leave_the_quads_edges_as_they_are():
    volume = white_noise(12)
    manifold, asymptotic = extract(volume), extract(volume, topology="asymptotic")
    assert [edge for edge, _ in manifold.quads] == [edge for edge, _ in asymptotic.quads]


def test_each_flip_adds_one_polygon_in_both_cells():
    volume = white_noise(12)
    manifold, asymptotic = extract(volume), extract(volume, topology="asymptotic")
    assert len(manifold.flipped) > 0
    assert manifold.polygon_count == asymptotic.polygon_count + 2 * len(manifold.flipped)


def test_a_closed_border_makes_every_edge_shared_by_two_quads():
    assert set(edge_use(extract(white_noise(10), border="closed"))) == {2}


def test_a_vertex_between_two_boxes_is_pinched():
    box = extract(one_inside_node()).indexed_quads()[1]
    other = np.where(box == 0, 0, box + 7)
    assert np.flatnonzero(pinched_vertices(np.concatenate([box, other]), 15)).tolist() == [0]


def test_no_vertex_of_a_box_is_pinched():
    assert not pinched_vertices(extract(one_inside_node()).indexed_quads()[1], 8).any()
