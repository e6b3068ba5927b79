"""Hold sets of quads or vertices on the device: 32 to a word, listed and counted in the order of numbers.

A *mask* is uint32 (ceil(n / 32),); bit b of word w stands for item 32 w + b. A list of its members is made by
count, scan and emit, so that it is the same on any device and for any number of threads.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.bits.flags import ANY, flagged
from dmc_cli.bits.words import VECTOR_FLAGS, bit_index
from dmc_cli.runtime import FLAGS_A_CHUNK, Device, adopt

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

WORDS = wp.constant(32)
"""Words of a mask that one thread counts and lists."""


KEY_FACTOR = wp.constant(wp.uint32(2654435769))
"""2^32 over the golden ratio (Knuth): odd, so no two keys are equal, and without order along the grid."""

WORDS_A_CHUNK = 256
"""Words of 32 items a chunk at least, as `ITEMS_A_CHUNK` of the device."""

MASKS_A_CHUNK = 32
"""Blocks of words of a mask a chunk at least."""

SHORT = 1 << 13
"""Items of a list that NumPy goes through, on CPU, while a kernel and a scan would be made ready."""


def mask_length(count: int) -> int:
    """Return the number of words of a mask over `count` items."""
    return -(-count // 32)


def list_mask(device: Device, mask: Any) -> Any:
    """Return the members of a mask in ascending order, int32."""
    starts, total = _count_mask(device, mask)
    listed = device.empty(total, wp.int32)
    device.launch(list_mask_kernel, starts.shape[0] - 1, [mask, starts], [listed], MASKS_A_CHUNK)
    return listed


def keep_masked(device: Device, items: Any, mask: Any) -> Any:
    """Return the items, int32 (n,), that are members of a mask over them, in their order."""
    if device.is_cpu and items.shape[0] <= SHORT:
        bits = np.unpackbits(mask.numpy().view(np.uint8), count=items.shape[0], bitorder="little")
        return adopt(items.numpy()[bits != 0], wp.int32)
    starts, total = _count_mask(device, mask)
    kept = device.empty(total, wp.int32)
    if total:
        device.launch(keep_masked_kernel, starts.shape[0] - 1, [items, mask, starts], [kept], MASKS_A_CHUNK)
    return kept


def mask_flagged(device: Device, flags: Any) -> tuple[Any, int]:
    """Return a mask of the items whose flag, uint8 (n,), is not 0, and how many there are."""
    mask = device.empty(mask_length(flags.shape[0]), wp.uint32)
    device.launch(mask_flagged_kernel, mask.shape[0], [flags], [mask], 16 * WORDS_A_CHUNK)
    return mask, _count_mask(device, mask)[1]


def _count_mask(device: Device, mask: Any) -> tuple[Any, int]:
    """Return the members before each block of words, with one item more, and the number of all."""
    blocks = -(-mask.shape[0] // int(WORDS))
    counts = device.empty(blocks, wp.int64)
    device.launch(count_mask_kernel, blocks, [mask], [counts], 8 * MASKS_A_CHUNK)
    return device.starts(counts)


def keep_flagged(device: Device, items: Any, flags: Any) -> Any:
    """Return the items, int32 (n,), whose flag, int64 (n,), 0 or 1, is set, in their order."""
    if device.is_cpu and items.shape[0] <= SHORT:
        return adopt(items.numpy()[flags.numpy() != 0], wp.int32)
    starts, total = device.starts(flags)
    kept = device.empty(total, wp.int32)
    device.launch(keep_flagged_kernel, items.shape[0], [items, starts], [kept], FLAGS_A_CHUNK)
    return kept


def part(device: Device, array: Any, start: int, end: int) -> Any:
    """Return a view of the items from `start` to `end` - 1 of an array, which may be none."""
    return array[start:end] if end > start else device.empty(0, array.dtype)


def concatenated(device: Device, lists: Sequence[Any]) -> Any:
    """Return the items of several lists, int32 (n,) each, one after the other."""
    joined = device.empty(sum(items.shape[0] for items in lists), wp.int32)
    start = 0
    for items in lists:
        count = items.shape[0]
        if count:
            wp.copy(joined, items, dest_offset=start, count=count)
        start += count
    return joined


@wp.kernel
def count_mask_kernel(
    # In:
    first: wp.int32,
    mask: wp.array(dtype=wp.uint32),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the members. One thread per block of words."""
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
) -> None:
    """List the members. One thread per block of words."""
    block = first + wp.tid()
    slot = starts[block]
    for w in range(block * WORDS, wp.min((block + 1) * WORDS, mask.shape[0])):
        remaining = mask[w]
        while remaining != wp.uint32(0):
            listed_out[slot] = 32 * w + bit_index(remaining)
            slot += wp.int64(1)
            remaining &= remaining - wp.uint32(1)


@wp.kernel
def keep_flagged_kernel(
    # In:
    first: wp.int32,
    items: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int64),
    # Out:
    kept_out: wp.array(dtype=wp.int32),
) -> None:
    """Keep the items before which and after which the count of flags differs. One thread per item."""
    n = first + wp.tid()
    if starts[n] != starts[n + 1]:
        kept_out[starts[n]] = items[n]


@wp.kernel
def keep_masked_kernel(
    # In:
    first: wp.int32,
    items: wp.array(dtype=wp.int32),
    mask: wp.array(dtype=wp.uint32),
    starts: wp.array(dtype=wp.int64),
    # Out:
    kept_out: wp.array(dtype=wp.int32),
) -> None:
    """Keep the members. One thread per block of words."""
    block = first + wp.tid()
    slot = wp.int32(starts[block])
    for w in range(block * WORDS, wp.min((block + 1) * WORDS, mask.shape[0])):
        remaining = mask[w]
        while remaining != wp.uint32(0):
            kept_out[slot] = items[32 * w + bit_index(remaining)]
            slot += 1
            remaining &= remaining - wp.uint32(1)


@wp.kernel
def mask_flagged_kernel(
    # In:
    first: wp.int32,
    flags: wp.array(dtype=wp.uint8),
    # Out:
    mask_out: wp.array(dtype=wp.uint32),
) -> None:
    """Gather the flags of 32 items into a word. One thread per word."""
    w = first + wp.tid()
    mask_out[w] = flagged(flags, 32 * w, 32, ANY)


@wp.func
def order_key(item: wp.int32) -> wp.uint32:
    """Return the key by which neighbours that contend are ordered, lowest first: a hash of the number."""
    return wp.uint32(item) * KEY_FACTOR
