"""A mesh has one share of irregular vertices, whoever asks: of quads, triangles, or both."""

import numpy as np
import pytest

from dmc_cli.errors import CallError
from dmc_cli.measures import measure_topology
from dmc_cli.mesh.connectivity import connect
from dmc_cli.mesh.valences import irregular_percent, regular_valence
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.mesh.meshes import on_device

DEVICE = Device("cpu", 2)


def with_unused(shape):
    """The shape with a vertex of no face."""
    points, faces = shape
    return np.concatenate([points, [[9, 9, 9]]]), faces


@pytest.mark.parametrize(
    ("shape", "regular"),
    [
        (shapes.sphere(4), 4),
        (shapes.torus(), 4),
        (shapes.open_strip(), 4),
        (shapes.halved(shapes.torus(), 1), 6),
        (shapes.halved(shapes.sphere(4), 1), 6),
        (shapes.halved(shapes.sphere(4), 3), 4),
        (with_unused(shapes.halved(shapes.sphere(4), 1)), 6),
        (with_unused(shapes.sphere(4)), 4),
    ],
)
def test_stages_and_the_report_have_one_share(shape, regular):
    mesh = connect(on_device(shape, DEVICE))
    assert regular_valence(mesh) == regular
    assert irregular_percent(mesh) == pytest.approx(measure_topology(mesh).irregular_percent)


def test_a_torus_is_regular_in_quads_and_in_triangles():
    assert irregular_percent(connect(on_device(shapes.torus(), DEVICE))) == 0
    assert irregular_percent(connect(on_device(shapes.halved(shapes.torus()), DEVICE))) == 0


def test_a_mesh_without_faces_has_none():
    nothing = np.zeros((2, 3)), np.zeros((0, 4), np.int32)
    assert irregular_percent(connect(on_device(nothing, DEVICE))) == 0


def test_a_mesh_that_is_not_connected_is_refused():
    with pytest.raises(CallError, match=r"call connect\(mesh\) first"):
        irregular_percent(on_device(shapes.torus(), DEVICE))
