"""Call Warp's compiled CPU kernels without `wp.launch`, which takes several times as long.

How a kernel takes its arguments is Warp's private business: whoever calls `CompiledKernel` asks
`is_known_version` and `takes_structs` first.
"""

import ctypes
import os
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any

import warp as wp

from dmc_cli.runtime.warp_launch import launch_by_warp

OTHER_RECORDS = (AttributeError, OSError, TypeError, ValueError)
"""What a version of Warp ends in whose records of launches are not as we know them."""

KNOWN_VERSIONS = ("1.19",)
"""Warp's versions that the tests ran on, without the last number: `pyproject.toml` has the same bounds."""

LOADING = RLock()
"""Held while Warp loads kernels, and while the process forks: a child could not release what Warp holds."""

if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=LOADING.acquire, after_in_parent=LOADING.release, after_in_child=LOADING.release
    )


class CompiledKernel:
    """A kernel's compiled function, which takes its arguments as one struct.

    Warp's own record of a first launch, whose arguments Warp has checked, tells how the struct is laid out.
    Nothing is kept of it that holds the arrays of that launch.

    Raises:
        AttributeError: The record is not as we know it.
    """

    def __init__(self, kernel: Any, arguments: Sequence[Any]) -> None:
        with LOADING:
            record = launch_by_warp(kernel, 1, arguments, "cpu", is_recorded=True)
        packed = record.params[1:]  # after the bounds
        if len(packed) != len(arguments):
            raise AttributeError("the record of a launch has other parameters than the kernel")
        self._name = kernel.key
        self._module = record.module_exec  # as long as it is held, its code stays
        self._bounds = type(record.bounds)
        self._arrays = [(a.dtype, a.ndim) if isinstance(a, wp.array) else None for a in arguments]
        fields = [(f"argument{n}", type(a)) for n, a in enumerate(packed)]
        self._struct = type("Arguments", (ctypes.Structure,), {"_fields_": fields})
        self.call = record.hooks.forward
        self.address = ctypes.cast(self.call, ctypes.c_void_p).value or 0

    @property
    def source(self) -> str:
        """Return the C++ that Warp made of the kernel's module."""
        binary = Path(self._module.binary_path)
        return binary.with_name(f"{binary.name.partition('.cpu')[0]}.cpp").read_text("utf-8")

    def pack(self, arguments: Sequence[Any]) -> ctypes.Structure:
        """Return the struct of a launch's arguments.

        Raises:
            TypeError: An array's type is not that of the first launch.
            ValueError: There are more or fewer arguments.
        """
        values = []
        for argument, kind in zip(arguments, self._arrays, strict=True):
            if kind is not None and (
                type(argument) is not wp.array or argument.dtype is not kind[0] or argument.ndim != kind[1]
            ):
                raise TypeError(f"{self._name} takes arrays of {self._arrays}, got {argument!r:.200}")
            values.append(argument.__ctype__() if hasattr(argument, "__ctype__") else argument)
        packed: ctypes.Structure = self._struct(*values)
        return packed

    def bounds(self, count: int) -> Any:
        """Return Warp's struct of the bounds of a launch of `count` threads."""
        return self._bounds((count,))

    def prepared(self, arguments: Sequence[Any], count: int = 1) -> Callable[[], None]:
        """Return a function that launches `count` threads of the kernel in the thread that calls it."""
        return partial(self.call, ctypes.byref(self.bounds(count)), ctypes.byref(self.pack(arguments)))


def is_known_version() -> bool:
    """Return whether the tests ran on this version of Warp, the last number aside."""
    return ".".join(wp.config.version.split(".")[:2]) in KNOWN_VERSIONS


def takes_structs(source: str, kernel: str) -> bool:
    """Return whether a kernel in Warp's C++ takes bounds and its arguments as one struct, as we give it."""
    entry = rf"void ({kernel}_\w+)_cpu_forward\(\s*wp::launch_bounds_t<1> \*\w+,\s*wp_args_\1 \*\w+\)"
    return re.search(rf"WP_API {entry}", source) is not None
