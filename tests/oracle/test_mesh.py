"""The oracle's halfedges, colours and simplification: invariants, and the reference counts."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from tests.fields import (
    NON_MANIFOLD_ISOVALUES,
    non_manifold_volume,
    one_inside_node,
    paper_field,
    plane,
    white_noise,
)
from tests.oracle.coloring import grid_color, reduce_colors
from tests.oracle.halfedges import NO_TWIN, fan_counts, find_faults, twins_from_grid, valences
from tests.oracle.simplify import ColoredMesh, chosen_by_color, pattern_3x3y, simplify
from tests.oracle.surface import extract_oracle_surface
from tests.reference import rows_of_size

SIMPLIFIED = [row for row in rows_of_size(32) if row["removed_colour"]]


def extract(volume, isovalue=0.0, **settings):
    return extract_oracle_surface(volume, SurfaceSettings(isovalue=isovalue, **settings))


def mesh_of(surface):
    vertices, quads = surface.indexed_quads()
    twins = twins_from_grid(surface)
    colors = reduce_colors(np.array([grid_color(edge) for edge, _ in surface.quads]), twins)
    positions = np.array([v.cell for v in vertices], dtype=np.float64) + 0.5
    return ColoredMesh(positions, quads, twins, colors)


SURFACES = {
    "box": (one_inside_node, 0.0),
    "plane": (plane, 0.0),
    "noise": (lambda: white_noise(12), 0.0),
    **{
        name: (lambda name=name: non_manifold_volume(name), isovalue)
        for name, isovalue in NON_MANIFOLD_ISOVALUES.items()
    },
}


@pytest.fixture(params=SURFACES)
def volume_and_isovalue(request):
    make, isovalue = SURFACES[request.param]
    return make(), isovalue


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


@pytest.mark.parametrize("topology", ["asymptotic", "manifold"])
def test_twins_from_the_grid_keep_every_invariant(volume_and_isovalue, border, topology):
    mesh = mesh_of(extract(*volume_and_isovalue, border=border, topology=topology))
    assert find_faults(mesh.quads, mesh.twins) == []


def test_every_vertex_of_a_manifold_surface_has_one_ring_or_fan(volume_and_isovalue, border):
    mesh = mesh_of(extract(*volume_and_isovalue, border=border))
    assert set(fan_counts(mesh.quads, mesh.twins, mesh.vertex_count)) == {1}


def test_every_vertex_of_a_closed_asymptotic_surface_has_one_ring(volume_and_isovalue):
    mesh = mesh_of(extract(*volume_and_isovalue, border="closed", topology="asymptotic"))
    assert set(fan_counts(mesh.quads, mesh.twins, mesh.vertex_count)) == {1}


def test_a_closed_surface_has_a_twin_for_every_halfedge(volume_and_isovalue):
    assert NO_TWIN not in twins_from_grid(extract(*volume_and_isovalue, border="closed"))


def test_the_checker_names_a_halfedge_whose_twin_does_not_answer():
    mesh = mesh_of(extract(one_inside_node()))
    twins = mesh.twins.copy()
    twins[twins[5]] = NO_TWIN
    assert find_faults(mesh.quads, twins) == [f"halfedge 5 has twin {twins[5]}, whose twin is -1"]


def test_the_checker_names_twins_between_different_vertices():
    quads = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])
    twins = np.array([4, NO_TWIN, NO_TWIN, NO_TWIN, 0, NO_TWIN, NO_TWIN, NO_TWIN])
    assert "do not run opposite ways" in find_faults(quads, twins)[0]


def test_the_valences_of_a_box_are_three():
    mesh = mesh_of(extract(one_inside_node()))
    assert valences(mesh.quads, mesh.twins, 8).tolist() == [3] * 8


def test_the_valence_at_an_open_border_counts_both_border_sides():
    mesh = mesh_of(extract(plane(nodes=4)))
    assert sorted(valences(mesh.quads, mesh.twins, 9)) == [2] * 4 + [3] * 4 + [4]


def test_five_colors_differ_across_every_twin(volume_and_isovalue, border):
    mesh = mesh_of(extract(*volume_and_isovalue, border=border, topology="asymptotic"))
    color = np.repeat(mesh.colors, 4)
    with_twin = mesh.twins != NO_TWIN
    assert mesh.colors.max() < 5
    assert (color[with_twin] != color[mesh.twins[with_twin]]).all()


def test_24_colors_differ_across_every_twin(volume_and_isovalue, border):
    surface = extract(*volume_and_isovalue, border=border, topology="asymptotic")
    twins = twins_from_grid(surface)
    color = np.repeat([grid_color(edge) for edge, _ in surface.quads], 4)
    assert (color[twins != NO_TWIN] != color[twins[twins != NO_TWIN]]).all()


@pytest.mark.parametrize(
    "row",
    [pytest.param(row, marks=pytest.mark.slow if row["field"] == "iwp" else ()) for row in SIMPLIFIED],
    ids=lambda row: f"{row['field']}-{row['n']}",
)
def test_the_papers_passes_remove_the_reference_counts(row):
    mesh = mesh_of(extract(paper_field(row["field"], int(row["n"])), topology="asymptotic"))
    result, removed = simplify(mesh)
    assert removed == tuple(int(row[f"removed_{name}"]) for name in ("colour", "counter", "3333"))
    assert result.vertex_count == int(row["vertices_after"])
    assert len(result.quads) == int(row["quads_after"])


def test_simplification_keeps_every_invariant_of_the_halfedges():
    result, removed = simplify(mesh_of(extract(paper_field("steiner", 32), topology="asymptotic")))
    assert min(removed) > 0
    assert find_faults(result.quads, result.twins) == []
    assert set(fan_counts(result.quads, result.twins, result.vertex_count)) == {1}


def test_quads_removed_together_share_no_vertex_of_valence_three():
    mesh = mesh_of(extract(paper_field("genus_two", 32)))
    corner, chosen = pattern_3x3y(mesh), chosen_by_color(mesh)
    merged = [int(mesh.quads[q, c]) for q in chosen for c in (corner[q], corner[q] + 2)]
    assert len(merged) == len(set(merged))


def test_simplification_leaves_a_box_alone():
    result, removed = simplify(mesh_of(extract(one_inside_node())))
    assert removed == (0, 0, 0)
    assert len(result.quads) == 6
