"""Components of nodes are those of SciPy, cavities too, and the same on any number of threads."""

import numpy as np
import pytest
from hypothesis import given, settings as profile, strategies as st
from scipy import ndimage

from dmc_cli.field import upload_volume
from dmc_cli.parts.components import find_components, find_sets, slice_weights
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume

SPACING = (0.5, 2.0, 3.0)


def volume_of(values, **given):
    return Volume(values=values, affine=np.diag([*SPACING, 1.0]), space="none", **given)


def found_in(volume, isovalue=0.5, *, threads=1, of_object=True, inside="above", device="cpu"):
    on_device = upload_volume(volume, select_device(device, threads))
    settings = SurfaceSettings(isovalue=isovalue, inside=inside)
    return find_components(on_device, settings, find_sets(on_device, settings), of_object=of_object)


def expected(mask):
    """Return nodes, least and greatest places of SciPy's components, the largest first, then in order."""
    labels, count = ndimage.label(mask)
    nodes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    boxes = ndimage.find_objects(labels)
    first = [np.flatnonzero(labels.ravel() == n + 1)[0] for n in range(count)]
    order = sorted(range(count), key=lambda n: (-nodes[n], first[n]))
    low = [[axis.start for axis in reversed(boxes[n])] for n in order]
    high = [[axis.stop - 1 for axis in reversed(boxes[n])] for n in order]
    return nodes[order].tolist(), low, high


@given(st.data())
@profile(max_examples=40)
def test_components_are_those_of_scipy(data):
    nx, ny, nz = (data.draw(st.integers(2, n)) for n in (70, 9, 9))
    share = data.draw(st.sampled_from([0.02, 0.3, 0.5, 0.7, 0.98]))
    mask = np.random.default_rng(data.draw(st.integers(0, 999))).random((nz, ny, nx)) < share
    of_object = data.draw(st.booleans())
    found = found_in(
        volume_of(mask.astype(np.uint8)), threads=data.draw(st.integers(1, 3)), of_object=of_object
    )
    nodes, low, high = expected(mask if of_object else ~mask)
    assert found.nodes.tolist() == nodes
    assert (found.low.tolist(), found.high.tolist()) == (low, high)
    np.testing.assert_allclose(found.volume_mm3, 3.0 * np.array(nodes))
    ends = np.array([nx, ny, nz]) - 1
    np.testing.assert_array_equal(found.is_open, ((found.low == 0) | (found.high == ends)).any(axis=1))


@pytest.mark.parametrize("inside", ["above", "below"])
def test_the_object_is_the_side_that_is_named_and_holds_no_node_without_data(inside, device):
    values = np.random.default_rng(0).integers(0, 10, (6, 7, 50)).astype(np.int16)
    found = found_in(volume_of(values, padding=(0, 1)), 5.0, inside=inside, device=device)
    mask = (values >= 5) if inside == "above" else (values < 5) & (values > 1)
    assert found.nodes.tolist() == expected(mask)[0]


def test_what_reaches_nodes_without_data_is_open():
    values = np.ones((9, 9, 9), np.float32)
    values[2:4, 2:4, 2:4] = 0
    values[5:7, 5:7, 5:7] = 0
    values[6, 6, 6] = np.nan
    found = found_in(volume_of(values), of_object=False)
    assert sorted(found.is_open.tolist()) == [False, True]
    assert found.nodes.tolist() == [8, 8]


def test_labels_do_not_depend_on_threads():
    mask = ndimage.gaussian_filter(np.random.default_rng(3).normal(size=(40, 30, 64)), 0.8) > 0.1
    found = [found_in(volume_of(mask.astype(np.uint8)), threads=threads) for threads in (1, 2, 5)]
    for other in found[1:]:
        np.testing.assert_array_equal(other.numbers.numpy(), found[0].numbers.numpy())


def test_uneven_slices_weigh_what_they_take():
    volume = volume_of(np.ones((4, 3, 3), np.uint8), slice_positions=np.array([0.0, 2.0, 4.0, 9.0]))
    assert slice_weights(volume).sum() / 65536 * volume.spacing[2] == pytest.approx(2 + 2 + 3.5 + 5, abs=1e-3)


def test_no_node_and_all_nodes():
    assert len(found_in(volume_of(np.zeros((3, 3, 3), np.uint8)))) == 0
    assert found_in(volume_of(np.ones((3, 3, 3), np.uint8))).nodes.tolist() == [27]
