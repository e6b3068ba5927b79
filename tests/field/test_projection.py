"""The way back to the surface ends within a cell of its start, in a cell that has data, or nowhere."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.field import upload_volume
from dmc_cli.field.field import Field, make_field
from dmc_cli.field.grid import Grid, grid_of
from dmc_cli.field.projection import GridPoint, project_point
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from tests.fields import volume_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.kernel
def project_kernel(
    first: wp.int32,
    field: Field,
    grid: Grid,
    starts: wp.array(dtype=wp.vec3d),
    out: wp.array(dtype=GridPoint),
):
    n = first + wp.tid()
    out[n] = project_point(field, grid, starts[n])


def projected(values, starts, device):
    """Return where points in node indices are led to, in node indices, and whether that is found."""
    volume = volume_of(np.asarray(values, np.float64))
    on_device = select_device(device, 1)
    field = make_field(upload_volume(volume, on_device), SurfaceSettings(isovalue=0.0))
    field.has_nodata = int(np.isnan(volume.values).any())
    out = wp.zeros(len(starts), dtype=GridPoint, device=device)
    places = wp.array(np.asarray(starts, float), dtype=wp.vec3d, device=device)
    on_device.launch(project_kernel, len(starts), [field, grid_of(volume.shape, 0).struct(), places], [out])
    found = out.numpy()
    return found["cell"] + found["local"].astype(float), found["is_found"]


def plane(height=4.5, nodes=9):
    return np.broadcast_to(height - np.arange(nodes, dtype=float), (nodes, nodes, nodes)).copy()


@pytest.mark.parametrize(
    ("x", "is_found"),
    [(3.45, False), (3.55, True), (4.5, True), (5.45, True), (5.55, False), (1.2, False), (7.9, False)],
)
def test_what_is_further_than_a_cell_is_not_found(device, x, is_found):
    found, says = projected(plane(), [[x, 3.3, 2.2]], device)
    assert bool(says[0]) is is_found
    if is_found:
        np.testing.assert_allclose(found[0], [4.5, 3.3, 2.2], atol=1e-6)


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1e-14, 1e14, 1e30, 1e300])
def test_values_of_any_size_lead_to_the_same_points(device, scale):
    k, j, i = np.indices((8, 8, 8)) - 3.5
    values = 2.6 - np.sqrt(i**2 + j**2 + k**2)
    starts = np.random.default_rng(5).uniform(1.5, 5.5, (200, 3))
    expected, known = projected(values, starts, device)
    found, says = projected(scale * values, starts, device)
    assert known.sum() > 50
    assert np.mean(says == known) > 0.98
    both = says & known
    assert np.mean(np.abs(found[both] - expected[both]).max(axis=1) < 1e-3) > 0.98


def test_a_cell_without_data_is_not_arrived_in(device):
    values = plane()
    values[2, 3, 5] = np.nan
    starts = [[4.2, 2.5, 1.5], [4.2, 3.5, 2.5], [4.2, 5.5, 2.5], [4.2, 2.5, 3.5]]
    assert projected(values, starts, device)[1].tolist() == [False, False, True, True]


def test_where_the_field_is_flat_nothing_is_found(device):
    assert not projected(np.zeros((4, 4, 4)), [[1.5, 1.5, 1.5]], device)[1].any()
    assert not projected(np.ones((4, 4, 4)), [[1.5, 1.5, 1.5]], device)[1].any()
