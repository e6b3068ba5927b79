"""Twins from the grid are the oracle's; a vertex's halfedge starts its fan; the checker finds every fault."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given

from dmc_cli.contouring import connect_faces
from dmc_cli.errors import MeshInvariantError
from dmc_cli.mesh.check_halfedges import check_halfedges, count_fans
from dmc_cli.mesh.halfedges import NO_TWIN
from dmc_cli.mesh.mesh import DEFECT
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import (
    NON_MANIFOLD_ISOVALUES,
    non_manifold_volume,
    one_cell,
    one_inside_node,
    paper_field,
    plane,
    smooth_noise,
    touching_nodes,
    volume_of,
    white_noise,
)
from tests.oracle.edges import vertex_pairs
from tests.oracle.halfedges import fan_counts, find_faults, twins_from_grid, valences
from tests.oracle.surface import extract_oracle_surface
from tests.strategies import volumes_with_settings

VOLUMES = {
    "box": (one_inside_node, 0.0),
    "touching": (touching_nodes, 0.0),
    "plane": (plane, 0.0),
    "noise": (lambda: white_noise(12), 0.0),
    "long noise": (lambda: white_noise_of(5, 6, 67), 0.0),
    "smooth noise": (lambda: smooth_noise(20), 0.0),
    "one cell": (lambda: one_cell(0x81), 0.0),
    "steiner": (lambda: paper_field("steiner", 24), 0.0),
    **{
        name: (lambda name=name: non_manifold_volume(name), isovalue)
        for name, isovalue in NON_MANIFOLD_ISOVALUES.items()
    },
}


def white_noise_of(nz, ny, nx):
    return volume_of(np.random.default_rng(1).standard_normal((nz, ny, nx)).astype(np.float32))


def assert_same_halfedges(surface, oracle, *, one_fan):
    """Fail unless twins, valences, defects and fans are the oracle's, whose quads begin at other corners."""
    surface = connect_faces(surface)
    halfedges = surface.mesh.halfedges
    quads, twin = surface.mesh.faces.numpy(), halfedges.twin.numpy()
    count = surface.mesh.vertex_count
    cells = surface.placement.cell.numpy()
    turn = np.zeros(len(quads), dtype=np.int64)
    for q, (_, corners) in enumerate(oracle.quads):
        expected = [oracle.grid.linear_index(v.cell) for v in corners]
        found = cells[quads[q]].tolist()
        turn[q] = next(c for c in range(4) if expected[c:] + expected[:c] == found)
    theirs = twins_from_grid(oracle)
    ours = np.repeat(np.arange(len(quads)), 4) * 4 + (np.arange(4 * len(quads)) + np.repeat(turn, 4)) % 4
    # halfedge h of ours is halfedge ours[h] of the oracle's
    back = np.empty(len(ours), dtype=np.int64)
    back[ours] = np.arange(len(ours))
    expected = np.where(theirs[ours] == NO_TWIN, NO_TWIN, back[theirs[ours]])
    np.testing.assert_array_equal(twin, expected)
    assert find_faults(quads, twin) == []
    np.testing.assert_array_equal(halfedges.valence.numpy(), valences(quads, twin, count))
    np.testing.assert_array_equal(
        surface.mesh.face_values[DEFECT].numpy().astype(bool), defects_of(quads, twin)
    )
    check_halfedges(quads, twin, halfedges.vertex_halfedge.numpy(), one_fan=one_fan)
    np.testing.assert_array_equal(
        count_fans(quads, twin, halfedges.vertex_halfedge.numpy()), fan_counts(quads, twin, count)
    )


def defects_of(quads, twin):
    """Quads with a side without a twin or on a vertex pair of more than two quads."""
    _, pair, use = np.unique(vertex_pairs(quads), return_inverse=True, return_counts=True)
    return ((use[pair] > 2) | (twin == NO_TWIN)).reshape(-1, 4).any(axis=1)


@pytest.mark.parametrize("topology", ["manifold", "asymptotic"])
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("name", VOLUMES)
def test_the_halfedges_are_the_oracles(extract, name, border, topology):
    make, isovalue = VOLUMES[name]
    volume = make()
    surface = extract(volume, isovalue, border=border, topology=topology, threads=2)
    settings = SurfaceSettings(isovalue=isovalue, border=border, topology=topology)
    one_fan = topology == "manifold" or border == "closed"
    assert_same_halfedges(surface, extract_oracle_surface(volume, settings), one_fan=one_fan)


@given(volumes_with_settings())
def test_the_halfedges_of_any_volume_are_the_oracles(volume_and_settings):
    volume, settings = volume_and_settings
    surface = extract_on("cpu", volume, settings)
    one_fan = settings.topology == "manifold" or settings.border == "closed"
    assert_same_halfedges(surface, extract_oracle_surface(volume, settings), one_fan=one_fan)


def test_threads_do_not_show(extract):
    volume = white_noise(40)
    one, four = (connect_faces(extract(volume, threads=threads)).mesh for threads in (1, 4))
    for field in ("twin", "vertex_halfedge", "valence"):
        found, expected = (getattr(mesh.halfedges, field).numpy() for mesh in (one, four))
        np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(one.face_values[DEFECT].numpy(), four.face_values[DEFECT].numpy())


def test_a_manifold_mesh_has_one_fan_a_vertex_and_an_asymptotic_one_may_have_more(extract):
    volume = non_manifold_volume("Non-Manifold-Vertex")
    fans = {}
    for topology in ("manifold", "asymptotic"):
        surface = extract(volume, 900.0, topology=topology)
        halfedges = connect_faces(surface).mesh.halfedges
        arrays = (surface.mesh.faces, halfedges.twin, halfedges.vertex_halfedge)
        fans[topology] = count_fans(*(array.numpy() for array in arrays))
    assert set(fans["manifold"].tolist()) == {1}
    assert fans["asymptotic"].max() >= 1


@pytest.fixture
def box():
    """Quads, twins and vertex halfedges of a box, to be spoilt."""
    surface = extract_on("cpu", one_inside_node(), SurfaceSettings(isovalue=0.0))
    halfedges = connect_faces(surface).mesh.halfedges
    return [
        surface.mesh.faces.numpy().copy(),
        halfedges.twin.numpy().copy(),
        halfedges.vertex_halfedge.numpy().copy(),
    ]


def test_the_checker_accepts_a_box(box):
    check_halfedges(*box)


def test_the_checker_names_a_halfedge_that_is_its_own_twin(box):
    box[1][7] = 7
    with pytest.raises(MeshInvariantError, match="halfedge 7 is its own twin"):
        check_halfedges(*box)


def test_the_checker_names_a_twin_that_does_not_answer(box):
    box[1][box[1][5]] = NO_TWIN
    with pytest.raises(MeshInvariantError, match=rf"halfedge 5 has twin {box[1][5]}, whose twin is -1"):
        check_halfedges(*box)


def test_the_checker_names_twins_that_run_the_same_way(box):
    a, b = 0, next(h for h in range(4, 24) if h not in box[1][:1] and box[1][h] != 0)
    c, d = box[1][a], box[1][b]
    box[1][[a, b, c, d]] = b, a, d, c
    with pytest.raises(MeshInvariantError, match="do not run opposite ways"):
        check_halfedges(*box)


def test_the_checker_names_a_twin_that_is_not_there(box):
    box[1][3] = 24
    with pytest.raises(MeshInvariantError, match="halfedge 3 has twin 24; expected -1 to 23"):
        check_halfedges(*box)


@pytest.mark.parametrize("twin", [-2, 24, 10**9])
def test_the_checker_names_twins_out_of_range(box, twin):
    box[1][3] = twin
    with pytest.raises(MeshInvariantError, match=f"halfedge 3 has twin {twin}; expected -1 to 23; please"):
        check_halfedges(*box)


def test_the_checker_counts_twins(box):
    box[1] = box[1][:-1]
    with pytest.raises(MeshInvariantError, match="24 halfedges have 23 twins"):
        check_halfedges(*box)


def test_the_checker_names_one_end_askew(box):
    """Twins with one vertex in common are none; either end is looked at."""
    quads = np.array([[0, 1, 2, 3], [1, 4, 5, 6]])
    for other in ([1, 4, 5, 6], [4, 0, 5, 6]):
        twin = np.full(8, NO_TWIN)
        twin[[0, 4]] = 4, 0
        quads[1] = other
        with pytest.raises(MeshInvariantError, match=r"halfedge 0 \(0 to 1\) and its twin 4"):
            check_halfedges(quads, twin, np.arange(7))


def test_the_checker_names_a_vertex_that_is_too_many():
    with pytest.raises(MeshInvariantError, match="a face has vertex 4; expected 0 to 3"):
        check_halfedges(np.array([[0, 1, 2, 4]]), np.full(4, NO_TWIN), np.array([0, 1, 2, 3]))
    check_halfedges(np.array([[0, 1, 2, 3]]), np.full(4, NO_TWIN), np.array([0, 1, 2, 3]))


@pytest.mark.parametrize("off", [-1, 24])
def test_the_checker_names_a_vertex_whose_halfedge_is_not_there(box, off):
    box[2][6] = off
    with pytest.raises(MeshInvariantError, match=f"vertex 6 has halfedge {off}; expected 0 to 23"):
        check_halfedges(*box)


def test_the_checker_names_a_halfedge_that_is_met_twice(box):
    """Two halfedges that wait for each other: their vertex's walk never comes home."""
    with pytest.raises(MeshInvariantError, match=r"halfedge \d+ is met twice on the way round its vertex"):
        count_fans(*with_a_loop(box))


def with_a_loop(box):
    quads, twin, start = box
    v = quads.ravel()[start[0]]
    ring = [start[0]]
    for _step in range(2):
        ring.append(twin[(ring[-1] & ~3) | ((ring[-1] + 3) & 3)])
    twin[(ring[2] & ~3) | ((ring[2] + 3) & 3)] = ring[1]
    assert v == quads.ravel()[ring[1]]
    return quads, twin, start


def test_the_checker_names_a_vertex_whose_halfedge_starts_elsewhere(box):
    vertex = box[0].ravel()[9]
    box[2][vertex] = 10
    with pytest.raises(MeshInvariantError, match=rf"vertex {vertex} has halfedge 10, which starts at"):
        check_halfedges(*box)


def test_the_checker_names_a_boundary_vertex_whose_halfedge_has_a_twin(extract):
    surface = extract(plane())
    halfedges = connect_faces(surface).mesh.halfedges
    quads, twin, start = (
        a.numpy().copy() for a in (surface.mesh.faces, halfedges.twin, halfedges.vertex_halfedge)
    )
    inner = next(h for h in range(len(twin)) if twin[h] >= 0 and twin[start[quads.ravel()[h]]] == NO_TWIN)
    start[quads.ravel()[inner]] = inner
    with pytest.raises(MeshInvariantError, match="is on a boundary, but its halfedge"):
        check_halfedges(quads, twin, start)


def test_the_checker_names_a_vertex_with_two_fans():
    quads = np.array([[0, 1, 2, 3], [0, 4, 5, 6]])
    twin = np.full(8, NO_TWIN)
    start = np.array([0, 1, 2, 3, 5, 6, 7])
    assert count_fans(quads, twin, start).tolist() == [2, 1, 1, 1, 1, 1, 1]
    check_halfedges(quads, twin, start, one_fan=False)
    with pytest.raises(MeshInvariantError, match="vertex 0 has 2 fans"):
        check_halfedges(quads, twin, start)


def test_an_empty_surface_has_no_halfedges(extract):
    surface = extract(one_cell(0))
    halfedges = connect_faces(surface).mesh.halfedges
    assert halfedges.twin.shape == (0,)
    assert halfedges.vertex_halfedge.shape == (0,)
    assert dataclasses.is_dataclass(halfedges)
