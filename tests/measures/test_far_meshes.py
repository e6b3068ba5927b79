"""Volume and shape of a mesh far from the origin are those of one near it."""

import numpy as np
import pytest

from dmc_cli.measures.quality import measure_quality
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.mesh.meshes import on_device


@pytest.mark.parametrize("scale", [2.0**-60, 1.0, 2.0**60])
@pytest.mark.parametrize("offset", [0.0, 2.0**20, -(2.0**20)])
def test_the_volume_of_a_house_does_not_depend_on_where_it_stands(device, offset, scale):
    points, faces = shapes.house()
    expected = 1 + 0.5 / 3
    moved = (scale * (np.asarray(points, float) + offset)).astype(np.float32)
    found = measure_quality(on_device((moved, faces), Device(device, 2)))
    assert found.signed_volume == pytest.approx(scale**3 * expected, rel=1e-13)
    assert found.shape_mean == pytest.approx(1.0, abs=1e-12)
    assert found.bounds[0] == (scale * offset,) * 3
