"""With `--topology manifold` every output is a 2-manifold, with boundary where the volume cuts it."""

import numpy as np
import pytest

from tests.fields import (
    NON_MANIFOLD_ISOVALUES,
    Volume,
    non_manifold_volume,
    paper_field,
    smooth_noise,
    volume_of,
    white_noise,
)
from tests.oracle.edges import pair_use, pinched_vertices


def missing_nodes() -> Volume:
    values = white_noise(24).values.copy()
    values[np.random.default_rng(7).random(values.shape) < 0.01] = np.nan
    return volume_of(values)


VOLUMES = {
    **{
        name: (lambda name=name: non_manifold_volume(name), level)
        for name, level in NON_MANIFOLD_ISOVALUES.items()
    },
    "white noise": (lambda: white_noise(64), 0.0),
    "smooth noise": (lambda: smooth_noise(64, sigma=0.7), 0.0),
    "smoother noise": (lambda: smooth_noise(64, sigma=2.0), 0.0),
    "steiner": (lambda: paper_field("steiner", 64), 0.0),
    "missing nodes": (missing_nodes, 0.0),
}


@pytest.fixture(params=VOLUMES)
def volume_and_isovalue(request):
    make, isovalue = VOLUMES[request.param]
    return make(), isovalue


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


def signed_volume(vertices, quads):
    a, b, c, d = vertices.astype(np.float64)[quads].transpose(1, 0, 2)
    return (np.einsum("ij,ij->", a, np.cross(b, c)) + np.einsum("ij,ij->", a, np.cross(c, d))) / 6.0


def test_no_vertex_pair_has_more_than_two_quads_and_no_vertex_is_pinched(
    extract, volume_and_isovalue, border
):
    surface = extract(*volume_and_isovalue, border=border, threads=2)
    quads = surface.mesh.faces.numpy()
    assert pair_use(quads).max() <= 2
    assert not pinched_vertices(quads, len(surface.placement.cell)).any()


def test_a_closed_border_leaves_no_boundary(extract, volume_and_isovalue):
    surface = extract(*volume_and_isovalue, border="closed", topology="manifold")
    assert set(pair_use(surface.mesh.faces.numpy())) == {2}


@pytest.mark.parametrize("topology", ["manifold", "asymptotic"])
def test_quads_have_four_different_vertices(extract, volume_and_isovalue, topology):
    quads = np.sort(extract(*volume_and_isovalue, topology=topology).mesh.faces.numpy(), axis=1)
    assert (np.diff(quads, axis=1) > 0).all()


def test_the_volume_of_a_closed_surface_is_positive(extract, volume_and_isovalue):
    surface = extract(*volume_and_isovalue, border="closed")
    assert signed_volume(surface.mesh.positions.numpy(), surface.mesh.faces.numpy()) > 0


def test_the_volume_of_a_closed_surface_round_the_low_side_is_positive(extract, volume_and_isovalue):
    surface = extract(*volume_and_isovalue, border="closed", inside="below")
    assert signed_volume(surface.mesh.positions.numpy(), surface.mesh.faces.numpy()) > 0


def test_the_volume_of_a_closed_surface_is_negative_with_gradient_normals(extract, volume_and_isovalue):
    surface = extract(*volume_and_isovalue, border="closed", orientation="gradient")
    assert signed_volume(surface.mesh.positions.numpy(), surface.mesh.faces.numpy()) < 0


def test_the_volume_stays_positive_in_a_mirrored_world(extract):
    volume = volume_of(white_noise(12).values, affine=np.diag([-1.0, 2.0, 3.0, 1.0]))
    surface = extract(volume, border="closed")
    assert signed_volume(surface.mesh.positions.numpy(), surface.mesh.faces.numpy()) > 0


def test_the_volume_stays_positive_under_a_negative_slope(extract):
    volume = volume_of(white_noise(12).values, slope=-2.0)
    surface = extract(volume, border="closed")
    assert signed_volume(surface.mesh.positions.numpy(), surface.mesh.faces.numpy()) > 0
