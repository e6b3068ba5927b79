"""Sets of quads or vertices on the device: 32 to a word, listed and counted in the order of their numbers.

A *mask* is uint32 (ceil(n / 32),); bit b of word w stands for item 32 w + b. A list of its members is made by
count, scan and emit, so that it is the same on any device and for any number of threads.
"""

from typing import Any

import warp as wp

from dmc_cli.device import Device
from dmc_cli.surface.grid import bit_index

wp.set_module_options({"enable_backward": False})

WORDS = wp.constant(32)
"""Words of a mask that one thread counts and lists."""


def mask_length(count: int) -> int:
    """Return the number of words of a mask over `count` items."""
    return -(-count // 32)


def list_mask(device: Device, mask: Any) -> Any:
    """Return the members of a mask in ascending order, int32."""
    blocks = -(-mask.shape[0] // int(WORDS))
    counts = device.empty(blocks, wp.int64)
    device.launch(count_mask_kernel, blocks, [mask], [counts])
    starts, total = device.starts(counts)
    listed = device.empty(total, wp.int32)
    device.launch(list_mask_kernel, blocks, [mask, starts], [listed])
    return listed


def keep_flagged(device: Device, items: Any, flags: Any) -> Any:
    """Return the items whose flag (int64, 0 or 1) is set, in their order."""
    starts, total = device.starts(flags)
    kept = device.empty(total, wp.int32)
    device.launch(keep_flagged_kernel, items.shape[0], [items, starts], [kept])
    return kept


def rank_marks(device: Device, marks: Any) -> tuple[Any, Any, int]:
    """Return the mask of what is not marked, how many such items lie before each word (int32), their number.

    Args:
        device: Where to work.
        marks: uint8 (n,), not 0 for a marked item.
    """
    count = marks.shape[0]
    words = mask_length(count)
    mask = device.empty(words, wp.uint32)
    counts = device.empty(words, wp.int64)
    device.launch(mask_unmarked_kernel, words, [marks], [mask, counts])
    starts, total = device.starts(counts)
    return mask, starts, total


@wp.kernel
def count_mask_kernel(
    # In:
    first: wp.int32,
    mask: wp.array(dtype=wp.uint32),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
):
    """Count the members. One thread a block of words."""
    block = first + wp.tid()
    count = wp.int32(0)
    for w in range(block * WORDS, wp.min((block + 1) * WORDS, mask.shape[0])):
        count += wp.int32(wp.bit_count(mask[w]))
    counts_out[block] = wp.int64(count)


@wp.kernel
def list_mask_kernel(
    # In:
    first: wp.int32,
    mask: wp.array(dtype=wp.uint32),
    starts: wp.array(dtype=wp.int64),
    # Out:
    listed_out: wp.array(dtype=wp.int32),
):
    """List the members. One thread a block of words."""
    block = first + wp.tid()
    slot = starts[block]
    for w in range(block * WORDS, wp.min((block + 1) * WORDS, mask.shape[0])):
        left = mask[w]
        while left != wp.uint32(0):
            listed_out[slot] = 32 * w + bit_index(left)
            slot += wp.int64(1)
            left &= left - wp.uint32(1)


@wp.kernel
def keep_flagged_kernel(
    # In:
    first: wp.int32,
    items: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int64),
    # Out:
    kept_out: wp.array(dtype=wp.int32),
):
    """Keep the items before which and after which the count of flags differs. One thread an item."""
    n = first + wp.tid()
    if starts[n] != starts[n + 1]:
        kept_out[starts[n]] = items[n]


@wp.kernel
def mask_unmarked_kernel(
    # In:
    first: wp.int32,
    marks: wp.array(dtype=wp.uint8),
    # Out:
    mask_out: wp.array(dtype=wp.uint32),
    counts_out: wp.array(dtype=wp.int64),
):
    """Gather the items without a mark. One thread a word."""
    w = first + wp.tid()
    word = wp.uint32(0)
    for item in range(32 * w, wp.min(32 * w + 32, marks.shape[0])):
        if marks[item] == wp.uint8(0):
            word |= wp.uint32(1) << wp.uint32(item - 32 * w)
    mask_out[w] = word
    counts_out[w] = wp.int64(wp.bit_count(word))


@wp.func
def new_number(mask: wp.array(dtype=wp.uint32), starts: wp.array(dtype=wp.int64), item: wp.int32) -> wp.int32:
    """Return how many members of a mask lie before an item: its number once the others have gone."""
    w = item >> 5
    below = (wp.uint32(1) << wp.uint32(item & 31)) - wp.uint32(1)
    return wp.int32(starts[w]) + wp.int32(wp.bit_count(mask[w] & below))
