"""Look at 32 flags at once: a byte an item, most of them 0."""

import warp as wp

wp.set_module_options({"enable_backward": False})

ANY = wp.constant(255)
"""Every bit of a flag."""


@wp.func_native(
    """
    const unsigned char* flag = (const unsigned char*)flags.data + start;
    const int remaining = (int)flags.shape[0] - start;
    unsigned int items = 0;
    if (span == 32 && remaining >= 32) {
        for (int n = 0; n < 32; ++n) items |= (unsigned int)((flag[n] & wanted) != 0) << n;
    } else {
        for (int n = 0; n < (remaining < span ? remaining : span); ++n)
            items |= (unsigned int)((flag[n] & wanted) != 0) << n;
    }
    return items;
    """
)
def flagged(flags: wp.array(dtype=wp.uint8), start: wp.int32, span: wp.int32, wanted: wp.int32) -> wp.uint32:
    """Return a bit for each of `span` items, 32 at most, from `start` on: its flag has a bit of `wanted`."""
    ...
