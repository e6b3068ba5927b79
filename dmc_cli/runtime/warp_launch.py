"""Launch kernels by Warp itself: on CUDA, and on CPU where they are not called as compiled functions."""

from collections.abc import Sequence
from typing import Any

import warp as wp


def launch_by_warp(
    kernel: Any, count: int, arguments: Sequence[Any], device: str, is_recorded: bool = False
) -> Any:
    """Run `count` threads of a kernel, or only return Warp's record of that launch.

    Args:
        kernel: A kernel of one dimension.
        count: Threads, at least 1.
        arguments: All of the kernel's.
        device: A name of Warp's.
        is_recorded: Whether to return Warp's record of the launch and run nothing.

    Raises:
        RuntimeError: Warp cannot launch the kernel with these arguments.
    """
    return wp.launch(kernel, dim=count, inputs=arguments, device=device, record_cmd=is_recorded)
