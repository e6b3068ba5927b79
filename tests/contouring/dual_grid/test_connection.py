"""Halfedges from the grid: those of any mesh where an edge has two quads, sound pairs where it has four."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from dmc_cli.contouring import connect_faces
from dmc_cli.mesh import DEFECT
from dmc_cli.mesh.check_halfedges import check_halfedges
from dmc_cli.mesh.defects import with_defects
from dmc_cli.mesh.twins import pair_halfedges
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import smooth_noise, volume_of, white_noise
from tests.oracle.edges import vertex_pairs
from tests.strategies import volumes_with_settings


def assert_sound(surface):
    mesh = connect_faces(surface).mesh
    faces, halfedges = mesh.faces.numpy().reshape(-1, 4), mesh.halfedges
    twin = halfedges.twin.numpy()
    check_halfedges(faces, twin, halfedges.vertex_halfedge.numpy(), one_fan=False)
    _, pair, uses = np.unique(vertex_pairs(faces), return_inverse=True, return_counts=True)
    # of four edges of an ambiguous face two may have quads, in two segments that each end at the boundary
    differs = (twin != pair_halfedges(faces)) & (uses[pair] <= 2)
    assert (twin[differs] == -1).all()
    assert not differs.any() or surface.placement.frame.grid.border == 0
    assert (twin[uses[pair] == 4] >= 0).all()
    edges = np.bincount(faces.ravel(), minlength=mesh.vertex_count)
    ends = np.bincount(np.roll(faces, -1, axis=1).ravel()[twin < 0], minlength=mesh.vertex_count)
    np.testing.assert_array_equal(halfedges.valence.numpy(), edges + ends)
    known = mesh.face_values[DEFECT].numpy()
    found = with_defects(mesh.with_face_values({DEFECT: None})).face_values[DEFECT].numpy()
    np.testing.assert_array_equal(known != 0, found != 0)
    return mesh


@given(volumes_with_settings())
@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_small_volume(device, drawn):
    volume, chosen = drawn
    names = ("isovalue", "inside", "border", "orientation")
    asked = SurfaceSettings(method="nets", **{name: getattr(chosen, name) for name in names})
    assert_sound(extract_on(device, volume, asked))


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("make", [lambda: white_noise(24), lambda: smooth_noise(40)], ids=["white", "smooth"])
def test_noise(extract, make, border):
    mesh = assert_sound(extract(make(), method="dc", border=border, threads=2))
    assert mesh.face_values[DEFECT].numpy().any() == (border == "open" or mesh.face_count > 10_000)


@pytest.mark.parametrize("nx", [31, 33, 65])
def test_missing_nodes(extract, nx):
    rng = np.random.default_rng(nx)
    noise = rng.standard_normal((8, 9, nx)).astype(np.float32)
    noise[rng.random(noise.shape) < 0.1] = np.nan
    assert_sound(extract(volume_of(noise), method="nets"))


def test_inside_corners_of_an_ambiguous_face_are_cut_off(extract):
    values = np.full((5, 6, 6), -1, dtype=np.float32)
    values[2, 2, 2] = values[2, 3, 3] = 1  # two nodes on a diagonal: two boxes that touch along an edge
    surface = connect_faces(extract(volume_of(values), method="nets"))
    faces, twin = surface.mesh.faces.numpy().reshape(-1, 4), surface.mesh.halfedges.twin.numpy()
    piece = np.arange(len(faces))
    for _ in range(len(faces)):
        piece = np.minimum(piece, piece[twin // 4].reshape(-1, 4).min(axis=1))
    assert len(faces) == 12
    assert len(set(piece.tolist())) == 2
