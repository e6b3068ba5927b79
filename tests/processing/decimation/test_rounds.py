"""`--quads` leaves the number that was asked for, or says why not, and keeps the mesh whole."""

import numpy as np
import pytest
from hypothesis import given, settings

from dmc_cli.contouring import color_faces, connect_faces
from dmc_cli.measures.distance import measure_distance
from dmc_cli.measures.quality import measure_quality
from dmc_cli.mesh.mesh import COLOR
from dmc_cli.mesh.valences import irregular_percent
from dmc_cli.processing.decimation import decimate
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.fields import one_inside_node, paper_field, plane, smooth_noise, sphere
from tests.processing.remeshing.test_rounds import assert_whole, turned_pairs
from tests.strategies import volumes_with_settings


def decimated(surface, quads):
    return decimate(surface.mesh, surface.placement, quads)


@pytest.fixture
def genus_two(extract):
    return connect_faces(extract(paper_field("genus_two", 24), border="closed", threads=2))


@pytest.mark.parametrize("share", [2, 4, 12])
def test_the_number_is_met_to_the_quad_and_the_mesh_stays_whole(genus_two, share):
    arrays = as_arrays(genus_two)
    wanted = genus_two.mesh.face_count // share
    result = decimated(genus_two, wanted)
    assert result.mesh.face_count == wanted == result.wanted
    assert_whole(genus_two, result)
    assert turned_pairs(result) == 0
    for key, value in as_arrays(genus_two).items():
        np.testing.assert_array_equal(value, arrays[key], err_msg=f"{key} was changed")


def test_a_quarter_is_near_the_surface_and_of_good_quads(genus_two):
    result = decimated(genus_two, genus_two.mesh.face_count // 4)
    found = measure_distance(result.mesh, genus_two.mesh)
    side = np.sqrt(measure_quality(genus_two.mesh).area / genus_two.mesh.face_count)
    assert found.to_other.mean <= 0.06 * side
    assert found.both.max <= side
    assert irregular_percent(result.mesh) <= 16  # of 1190 quads round two tunnels; a tooth has 8 %
    assert measure_quality(result.mesh).shape_mean >= 0.8


def test_what_topology_needs_is_left_and_said(extract):
    """A closed surface of two tunnels has no mesh of six quads."""
    surface = connect_faces(extract(paper_field("genus_two", 16), border="closed", threads=2))
    result = decimated(surface, 1)
    assert 6 < result.mesh.face_count < surface.mesh.face_count
    assert sum(result.refusals.values()) > 0
    assert_whole(surface, result)


def test_quads_at_a_boundary_stay(extract):
    surface = connect_faces(extract(plane(8)))
    result = decimated(surface, 1)
    assert result.fixed == 20  # of 6 x 6, those with a vertex on the boundary
    assert result.mesh.face_count >= result.fixed
    assert_whole(surface, result)


@pytest.mark.parametrize("quads", [6, 7])
def test_a_mesh_that_has_no_more_is_returned_as_it_is(extract, quads):
    surface = connect_faces(extract(one_inside_node()))
    result = decimated(surface, quads)
    assert result.rounds == 0
    np.testing.assert_array_equal(result.mesh.faces.numpy(), surface.mesh.faces.numpy())
    np.testing.assert_array_equal(result.mesh.positions.numpy(), surface.mesh.positions.numpy())


@pytest.mark.parametrize("nodes", [24, pytest.param(32, marks=pytest.mark.slow)])
def test_the_same_bytes_on_any_number_of_threads(extract, nodes):
    found = []
    for threads in (1, 2, 3):
        surface = connect_faces(extract(smooth_noise(nodes, 2.0), border="closed", threads=threads))
        found.append(as_arrays(decimated(surface, surface.mesh.face_count // 3)))
    for other in found[1:]:
        for key, value in found[0].items():
            np.testing.assert_array_equal(value, other[key], err_msg=key)


def test_colours_stay_proper(extract):
    surface = color_faces(connect_faces(extract(sphere(24), threads=2)))
    mesh = decimated(surface, 200).mesh
    color, twin = mesh.face_values[COLOR].numpy(), mesh.halfedges.twin.numpy()
    assert mesh.face_count == 200
    assert (np.repeat(color, 4)[twin >= 0] != color[twin[twin >= 0] // 4]).all()


@settings(max_examples=15)
@given(volumes_with_settings())
def test_any_mesh_stays_whole(volume_and_settings):
    volume, chosen = volume_and_settings
    before = connect_faces(extract_on("cpu", volume, chosen))
    result = decimated(before, max(1, before.mesh.face_count // 3))
    one_fan = chosen.topology == "manifold" or chosen.border == "closed"
    assert_whole(before, result, one_fan=one_fan)
    assert turned_pairs(result) <= turned_pairs(before)
