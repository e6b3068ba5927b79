"""Look at 32 flags at once: a byte an item, most of them 0."""

import warp as wp

from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False})

ANY = wp.constant(255)
"""Every bit of a flag."""


@wp.func_native(native(__file__, "flagged"))
def flagged(flags: wp.array(dtype=wp.uint8), start: wp.int32, span: wp.int32, wanted: wp.int32) -> wp.uint32:
    """Return a bit for each of `span` items, 32 at most, from `start` on: its flag has a bit of `wanted`."""
    ...
