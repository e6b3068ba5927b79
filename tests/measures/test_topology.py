"""Topology on meshes with known answers, and against plain counting on random ones."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st

import tests.measures.meshes as plain
from dmc_cli.mesh.twins import pair_halfedges
from tests import shapes


@pytest.fixture
def measure(device):
    return lambda shape: plain.topology_of(shape, device)


BETTI = {
    "cube": (shapes.cube(), (1, 0, 1)),
    "patch": (shapes.grid(3, 3), (1, 0, 0)),
    "ring": ((shapes.grid(3, 3)[0], np.delete(shapes.grid(3, 3)[1], 4, axis=0)), (1, 1, 0)),
    "torus": (shapes.torus(), (1, 2, 1)),
    "torus with a hole": ((shapes.torus()[0], shapes.torus()[1][1:]), (1, 2, 0)),
    "torus, cube and patch": (
        shapes.joined(shapes.joined(shapes.torus(), shapes.cube()), shapes.grid(2, 5)),
        (3, 2, 2),
    ),
    "tetrahedron": (shapes.tetrahedron(), (1, 0, 1)),
    "nothing": ((np.zeros((0, 3)), np.zeros((0, 4), np.int32)), (0, 0, 0)),
    "fans at one point": (shapes.pinched_vertex(), None),
    "strip with half a turn": (shapes.moebius_strip(), None),
}


@pytest.mark.parametrize("name", BETTI)
def test_betti_numbers_are_those_of_the_shape(measure, name):
    shape, expected = BETTI[name]
    assert measure(shape).betti_numbers == expected


def test_betti_numbers_of_many_open_components():
    points, quads = shapes.grid(40, 40)
    kept = quads[np.arange(1600) % 40 % 3 != 2]
    order = np.random.default_rng(0).permutation(len(kept))
    found = plain.topology_of((points, kept[order]))
    assert found.betti_numbers == (found.components, 0, 0)
    assert found.components == 14


def test_a_cube_is_a_sphere_with_eight_irregular_vertices(measure):
    found = measure(shapes.cube())
    assert (found.components, found.euler_characteristic, found.genus) == (1, 2, 0)
    assert (found.boundary_edges, found.boundary_loops) == (0, 0)
    assert found.valence_histogram == {3: 8}
    assert found.irregular_percent == 100.0
    assert found.is_manifold
    assert found.is_closed


def test_a_strip_has_one_boundary_loop(measure):
    found = measure(shapes.open_strip(5))
    assert (found.euler_characteristic, found.boundary_edges, found.boundary_loops) == (1, 12, 1)
    assert found.genus == 0
    assert found.valence_histogram == {2: 4, 3: 8}
    assert not found.is_closed


def test_a_torus_has_one_handle_and_no_irregular_vertex(measure):
    found = measure(shapes.torus())
    assert (found.euler_characteristic, found.genus) == (0, 1)
    assert found.valence_histogram == {4: 64}
    assert found.irregular_percent == 0.0


def test_a_pinched_vertex_is_not_manifold_and_does_not_join_the_loops(measure):
    found = measure(shapes.pinched_vertex())
    assert (found.non_manifold_vertices, found.non_manifold_edges) == (1, 0)
    assert (found.components, found.boundary_loops) == (2, 2)
    assert found.genus is None
    assert found.valence_histogram == {2: 6, 4: 1}


def test_a_moebius_strip_is_misoriented(measure):
    found = measure(shapes.moebius_strip())
    assert found.misoriented_edges == 1
    assert not found.is_manifold
    assert found.genus is None


def test_two_cubes_are_two_components(measure):
    found = measure(shapes.two_components())
    assert (found.components, found.euler_characteristic, found.genus) == (2, 4, 0)


def test_cubes_that_share_an_edge_have_one_crowded_edge(measure):
    found = measure(shapes.edge_to_edge_cubes())
    assert found.non_manifold_edges == 1
    assert found.boundary_edges == 0
    assert found.genus is None


def test_right_twins_keep_cubes_apart_that_share_an_edge(device):
    apart = shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (1, 1, 0)))
    twins = pair_halfedges(apart[1])
    found = plain.topology_of(shapes.welded(*apart), device, twins)
    assert (found.components, found.non_manifold_edges, found.non_manifold_vertices) == (2, 1, 2)


def test_cubes_that_share_a_corner_have_a_vertex_with_two_rings(measure):
    found = measure(shapes.corner_to_corner_cubes())
    assert (found.non_manifold_vertices, found.components) == (1, 2)
    assert found.valence_histogram == {3: 14, 6: 1}


@pytest.mark.parametrize(
    ("shape", "valences"), [(shapes.patch_3x3y(5, 6), [3, 5, 3, 6]), (shapes.patch_3333(), [3] * 4)]
)
def test_a_pattern_has_its_valences_in_the_middle(shape, valences):
    assert plain.plain_valences(shape[1], len(shape[0]))[:4].tolist() == valences
    found = plain.topology_of(shape)
    assert (found.components, found.boundary_loops, found.euler_characteristic) == (1, 1, 1)
    assert found.is_manifold


def test_triangles_are_regular_with_six_edges(measure):
    found = measure(shapes.tetrahedron())
    assert (found.euler_characteristic, found.boundary_edges) == (2, 0)
    assert found.irregular_percent == 100.0
    points, quads = shapes.grid(3, 3)
    triangles = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    patch = np.column_stack([triangles, np.full(len(triangles), -1)]).astype(np.int32)
    found = measure((points, patch))
    assert found.valence_histogram[6] == 4
    assert found.irregular_percent == 75.0


def test_a_mixed_mesh_is_measured_like_any(measure):
    found = measure(shapes.house())
    assert (found.components, found.euler_characteristic, found.genus) == (1, 2, 0)
    assert found.valence_histogram == {3: 4, 4: 5}


def test_an_empty_mesh_has_nothing(measure):
    found = measure((np.zeros((0, 3)), np.zeros((0, 4), dtype=np.int32)))
    assert (found.components, found.euler_characteristic, found.genus) == (0, 0, 0)
    assert found.irregular_percent == 0.0
    assert found.valence_histogram == {}


def test_unused_vertices_do_not_count(measure):
    points, quads = shapes.cube()
    found = measure((np.vstack([points, np.zeros((2, 3))]), quads))
    assert found.unused_vertices == 2
    assert found.euler_characteristic == 2


def test_the_apex_of_a_large_fan_has_all_its_edges(measure):
    n = 200
    rim = np.arange(n)
    faces = np.column_stack([np.full(n, n), rim, (rim + 1) % n, np.full(n, -1)]).astype(np.int32)
    found = measure((np.zeros((n + 1, 3)), faces))
    assert found.valence_histogram == {3: n, n: 1}
    assert found.is_manifold


def test_three_faces_on_an_edge_are_seen(measure):
    faces = np.array([[0, 1, 2, 3], [1, 0, 4, 5], [0, 1, 6, 7]], dtype=np.int32)
    found = measure((np.zeros((8, 3)), faces))
    assert found.non_manifold_edges == 1
    assert found.non_manifold_vertices == 2
    assert found.misoriented_edges == 0


def test_a_face_that_uses_a_vertex_twice_is_survived(measure):
    found = measure((np.zeros((4, 3)), np.array([[0, 1, 1, 2], [0, 2, 3, 3]], dtype=np.int32)))
    assert found.components == 1


@pytest.mark.parametrize(
    "shape", [shapes.cube(), shapes.torus(5, 7), shapes.grid(4, 3), shapes.house(), shapes.sphere(3)]
)
def test_euler_and_watertightness_agree_with_trimesh(shape):
    points, faces = shape
    rings = plain.face_rings(faces)
    triangles = [t for r in rings for t in ([r[:3], (r[0], r[2], r[3])] if len(r) == 4 else [r])]
    mesh = trimesh.Trimesh(points, triangles, process=False)
    found = plain.topology_of(shape)
    assert found.euler_characteristic == mesh.euler_number
    assert found.is_closed == mesh.is_watertight


def cut_open(twins, share, seed=0):
    """Twins of which a share is cut apart: a mesh that comes from a grid may have such seams."""
    twins = np.array(twins)
    chosen = np.flatnonzero((twins >= 0) & (np.random.default_rng(seed).random(len(twins)) < share))
    twins[twins[chosen]] = -1
    twins[chosen] = -1
    return twins


def test_an_edge_that_is_cut_open_is_one_edge_of_two_boundaries(device):
    """The fan of each of its ends begins and ends at the same vertex."""
    points, quads = shapes.cube()
    twins = np.array(pair_halfedges(quads))
    twins[[0, twins[0]]] = -1
    found = plain.topology_of((points, quads), device, twins)
    assert found.valence_histogram == {3: 8}
    assert (found.boundary_edges, found.boundary_loops, found.euler_characteristic) == (2, 1, 1)
    assert (found.non_manifold_edges, found.non_manifold_vertices, found.misoriented_edges) == (0, 0, 0)
    assert found.genus == 0


@st.composite
def soups(draw):
    """Random faces over few vertices: all kinds of defects."""
    vertex_count = draw(st.integers(4, 12))
    corner = st.lists(st.integers(0, vertex_count - 1), min_size=3, max_size=4, unique=True)
    faces = draw(st.lists(corner, min_size=0, max_size=14))
    rows = [f if len(f) == 4 else [*f, -1] for f in faces]
    return vertex_count, np.array(rows, dtype=np.int32).reshape(-1, 4)


@given(soups(), st.sampled_from([1, 3]), st.sampled_from([0.0, 0.2, 0.6]), st.integers(0, 99))
def test_random_soups_agree_with_plain_counting(soup, threads, share, seed):
    vertex_count, faces = soup
    twins = cut_open(pair_halfedges(faces), share, seed)
    found = plain.topology_of((np.zeros((vertex_count, 3)), faces), twins=twins, threads=threads)
    valences = plain.plain_valences(faces, vertex_count)
    values, counts = np.unique(valences[valences > 0], return_counts=True)
    links = [(f, twins[h] // 4) for f, _, _, h in plain.face_edges(faces) if twins[h] >= 0]
    assert found.valence_histogram == dict(zip(values.tolist(), counts.tolist(), strict=True))
    assert found.non_manifold_edges == plain.plain_crowded_edges(faces)
    assert found.non_manifold_vertices == plain.plain_split_vertices(faces, twins, vertex_count)
    assert found.components == plain.plain_classes(range(len(faces)), links)
    assert found.boundary_loops == plain.plain_loops(faces, twins)


def test_many_threads_find_the_same_as_one(device):
    rng = np.random.default_rng(3)
    points, quads = shapes.torus(150, 100)
    shuffled = rng.permutation(len(points)).astype(np.int32)[quads][rng.permutation(len(quads))[2000:]]
    one = plain.topology_of((points, shuffled), device, threads=1)
    assert all(plain.topology_of((points, shuffled), device, threads=4) == one for _ in range(5))
    assert one.boundary_edges > 0
    assert one.components > 1
