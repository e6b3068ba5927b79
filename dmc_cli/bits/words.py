"""Take words of 32 bits sixteen at a time, and look at what lies in one of them.

Loops over the lanes of a block have no branch, so that the compiler turns them into vector instructions.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

_FLAGS = "-march=native" if wp.config.cpu_compiler_flags is None else wp.config.cpu_compiler_flags

VECTOR_FLAGS = f"{_FLAGS} -mprefer-vector-width=512"
"""Warp's own flags, and leave to use the widest vector registers there are."""

LANES = 16
"""Words a block: one vector register of 512 bits."""

Words = wp.types.vector(length=LANES, dtype=wp.uint32)
"""Sixteen words of the line, one after the other."""


ALL_BITS = wp.uint32(0xFFFFFFFF)
"""A word with every bit set."""


@wp.func
def low_bits(count: wp.int32) -> wp.uint32:
    """Return a word whose lowest `count` bits are set; `count` may be below 0 or above 32."""
    some = (wp.uint32(1) << wp.uint32(wp.clamp(count, 0, 31))) - wp.uint32(1)
    return wp.where(count >= 32, ALL_BITS, some)


@wp.func
def bit_index(word: wp.uint32) -> wp.int32:
    """Return the index of the lowest set bit; `word` is not 0."""
    return wp.int32(wp.bit_count(~word & (word - wp.uint32(1))))  # one instruction: a count of trailing zeros


@wp.func
def has_bit(word: wp.uint32, bit: wp.int32) -> wp.bool:
    """Return whether bit `bit` of `word` is set."""
    return ((word >> wp.uint32(bit)) & wp.uint32(1)) != wp.uint32(0)


@wp.func
def next_node(word: wp.uint32, following: wp.uint32) -> wp.uint32:
    """Return the bits of the nodes one step along +x; `following` is the next word of the row."""
    return (word >> wp.uint32(1)) | (following << wp.uint32(31))


@wp.func
def previous_node(word: wp.uint32, preceding: wp.uint32) -> wp.uint32:
    """Return the bits of the nodes one step along -x; `preceding` is the previous word of the row."""
    return (word << wp.uint32(1)) | (preceding >> wp.uint32(31))
