"""Lists of members, by kernels and, where they are short, by NumPy: the same."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings, strategies as st

from dmc_cli.bits import selection
from dmc_cli.bits.selection import keep_flagged, keep_masked, list_mask, mask_flagged, mask_length
from dmc_cli.runtime.device import select_device

DEVICE = select_device("cpu", 2)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 5000), st.floats(0, 1), st.integers(0, 9), st.sampled_from([0, selection.SHORT]))
def test_members_are_kept_in_their_order(count, share, seed, short):
    random = np.random.default_rng(seed)
    chosen = random.random(count) < share
    items = random.integers(0, 2**31 - 1, count, dtype=np.int32)
    bits = np.zeros(32 * mask_length(count), np.uint8)
    bits[:count] = chosen
    mask = wp.array(np.packbits(bits, bitorder="little").view(np.uint32), dtype=wp.uint32, device="cpu")
    listed = wp.array(items, dtype=wp.int32, device="cpu")
    flags = wp.array(chosen.astype(np.int64), dtype=wp.int64, device="cpu")
    marks = wp.array(chosen.astype(np.uint8), dtype=wp.uint8, device="cpu")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(selection, "SHORT", short)
        assert np.array_equal(keep_masked(DEVICE, listed, mask).numpy(), items[chosen])
        assert np.array_equal(keep_flagged(DEVICE, listed, flags).numpy(), items[chosen])
    assert np.array_equal(list_mask(DEVICE, mask).numpy(), np.flatnonzero(chosen))
    gathered, total = mask_flagged(DEVICE, marks)
    assert np.array_equal(gathered.numpy(), mask.numpy())
    assert total == np.count_nonzero(chosen)
