"""Vertices get their new numbers wherever in a block of quads they are."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given, strategies as st

from dmc_cli.mesh.compaction import rename_vertices_kernel
from dmc_cli.mesh.working import MeshArrays
from dmc_cli.runtime.device import Device

END = 100
MOVED_TO = np.arange(50, dtype=np.int32)[::-1].copy()
"""New numbers of the vertices 100 to 149."""


def renamed(corners):
    mesh = MeshArrays()
    mesh.corners = wp.array(corners, dtype=wp.int32, device="cpu")
    moved = wp.array(MOVED_TO, dtype=wp.int32, device="cpu")
    blocks = -(-len(corners) // 64)
    Device("cpu", 2).launch(rename_vertices_kernel, blocks, [mesh, END, len(corners), moved], [], 1)
    return mesh.corners.numpy()


def expected(corners):
    return np.where(corners >= END, MOVED_TO[np.maximum(corners - END, 0)], corners)


@pytest.mark.parametrize("count", [64, 128, 132])
def test_a_single_vertex_is_found_at_every_place(count):
    for place in range(count):
        corners = np.full(count, END - 1, dtype=np.int32)
        corners[place] = END
        np.testing.assert_array_equal(renamed(corners), expected(corners))


@given(st.integers(1, 70), st.integers(0, 2**32 - 1), st.floats(0, 0.2))
def test_vertices_that_moved_get_their_new_numbers_and_no_others(quads, seed, share):
    rng = np.random.default_rng(seed)
    corners = rng.integers(0, END, 4 * quads).astype(np.int32)
    high = rng.random(4 * quads) < share
    corners[high] = rng.integers(END, END + 50, high.sum())
    np.testing.assert_array_equal(renamed(corners), expected(corners))
