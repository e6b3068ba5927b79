"""A module with one small kernel, which is compiled in a second."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def double_kernel(first: wp.int32, values: wp.array(dtype=wp.int32)):
    i = first + wp.tid()
    values[i] = 2 * values[i]
