"""Weights of sizes are what NumPy makes of the same areas."""

import numpy as np

from dmc_cli.contouring import connect_faces
from dmc_cli.mesh import working_mesh
from dmc_cli.processing.decimation.sizes import MOST_RATIO, POWER, SPREAD, size_weights
from tests.fields import plane, smooth_noise


def expected_weights(mesh):
    corners = mesh.positions.numpy().astype(float)[mesh.faces.numpy()]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1
    )
    mean = area.mean()
    twin = mesh.halfedges.twin.numpy().reshape(-1, 4)
    for _ in range(SPREAD):
        area = (area + np.where(twin >= 0, area[twin >> 2], 0).sum(axis=1)) / (1 + (twin >= 0).sum(axis=1))
    return np.clip(area / mean, 1 / MOST_RATIO, MOST_RATIO) ** POWER


def test_weights_are_a_power_of_the_areas_round_about(extract):
    surface = connect_faces(extract(smooth_noise(16, 1.5)))  # with a boundary
    found = size_weights(working_mesh(surface.mesh, surface.placement)).numpy()
    expected = expected_weights(surface.mesh)
    assert expected.max() > 100 * expected.min()
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_equal_quads_weigh_one(extract):
    surface = connect_faces(extract(plane(8)))
    found = size_weights(working_mesh(surface.mesh, surface.placement)).numpy()
    np.testing.assert_allclose(found, 1, rtol=1e-4)
