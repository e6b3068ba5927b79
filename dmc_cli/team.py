"""The CPU threads that share a launch.

Warp runs a launch on one core, and to wake a thread for the half of it takes a hundred microseconds, as long
as many a launch. So a team calls the compiled kernels itself, slab by slab: its helpers watch for launches
from native code (`desk.py`), without the interpreter's lock, and sleep only when there has been none for a
while. Which thread works on which slab never shows in the result: no kernel hands out slots by atomics.
"""

import ctypes
import re
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import warp as wp

from dmc_cli import desk

SLABS_PER_THREAD = 64
"""Slabs a thread at most: enough to even out where the surface is dense."""

PATIENCE = 6000
"""Turns that a helper waits for the next launch before it sleeps: two milliseconds where nobody else wants
the processor."""

OTHER_RECORDS = (AttributeError, OSError, TypeError, ValueError)
"""What a version of Warp ends in whose records of launches are not as we know them."""


class Compiled:
    """A kernel's compiled function, which takes its arguments as one struct.

    Warp's own record of a first launch, whose arguments Warp has checked, tells how the struct is laid out.
    Nothing is kept of it that holds the arrays of that launch.

    Raises:
        AttributeError: The record is not as we know it.
    """

    def __init__(self, kernel: Any, arguments: Sequence[Any]) -> None:
        record = wp.launch(kernel, dim=1, inputs=arguments, device="cpu", record_cmd=True)
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
        self.address = ctypes.cast(self.call, ctypes.c_void_p).value

    @property
    def source(self) -> str:
        """The C++ that Warp made of the kernel's module."""
        binary = Path(self._module.binary_path)
        return binary.with_name(f"{binary.name.partition('.cpu')[0]}.cpp").read_text()

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
        """Return the bounds of a launch of `count` threads."""
        return self._bounds((count,))

    def prepared(self, arguments: Sequence[Any], count: int = 1) -> Callable[[], None]:
        """Return a launch of `count` threads by whoever calls it."""
        return partial(self.call, ctypes.byref(self.bounds(count)), ctypes.byref(self.pack(arguments)))


class Team:
    """The calling thread and its helpers."""

    def __init__(self, threads: int) -> None:
        self._compiled: dict[Any, Compiled] = {}
        self._lock = Lock()
        self._pool = ThreadPoolExecutor(max(threads - 1, 1), thread_name_prefix="dmc")
        self._helpers: list[Future[None] | None] = [None] * (threads - 1)
        self._words = _aligned_words(desk.PARTS + desk.LINE * threads)
        self._words[desk.THREADS] = threads
        self._words[desk.YIELD] = _address_of_yield()
        self._desk = wp.array(
            ptr=self._words.ctypes.data, dtype=wp.int64, shape=self._words.shape, device="cpu", copy=False
        )
        self._begun: tuple[Any, ...] | None = None  # what the job on the desk needs to stay in memory
        try:
            lead = Compiled(desk.lead_kernel, [self._desk])
            self._knows_warp = _takes_structs(lead.source)
            self._lead = lead.prepared([self._desk])
            self._open = Compiled(desk.open_kernel, [self._desk]).prepared([self._desk])
            self._help = Compiled(desk.help_kernel, [self._desk, 0, PATIENCE])
        except OTHER_RECORDS:
            self._knows_warp = False

    def launch(self, kernel: Any, dim: int, arguments: Sequence[Any], grain: int) -> None:
        """Run a kernel for thread indices 0 to `dim` - 1, in slabs of at least `grain` of them.

        Args:
            kernel: A kernel of one dimension; its first argument is the index of a slab's first thread.
            dim: At least 1.
            arguments: The kernel's, the first one 0.
            grain: Least size of a slab.
        """
        self._start(kernel, dim, arguments, grain, ahead=False)
        self.finish()

    def begin(self, kernel: Any, dim: int, arguments: Sequence[Any], grain: int) -> None:
        """Begin what `launch` does: the helpers are at it while the caller gets the next launch ready.

        The next launch, or `finish`, sees it done; until then nobody looks at its arrays.
        """
        self._start(kernel, dim, arguments, grain, ahead=True)

    def finish(self) -> None:
        """See the launch done that was begun, if there is one."""
        if self._begun is not None:
            with self._lock:
                self._finish()

    def _finish(self) -> None:
        if self._begun is not None:
            self._lead()
            self._begun = None

    def _start(self, kernel: Any, dim: int, arguments: Sequence[Any], grain: int, ahead: bool) -> None:
        """See the launch before done; do one of a single slab, lay others on the desk."""
        self.finish()
        if not self._knows_warp:
            wp.launch(kernel, dim=dim, inputs=arguments, device="cpu")
            return
        compiled = self._compiled.get(kernel)
        if compiled is None:
            compiled = self._compiled[kernel] = Compiled(kernel, arguments)
        most = SLABS_PER_THREAD * (len(self._helpers) + 1) if self._helpers else 1
        slab = -(-dim // min(most, max(dim // grain, 1)))
        if slab == dim:
            compiled.prepared(arguments, dim)()
            return
        with self._lock:
            self._finish()  # of another caller
            slabs = self._lay_out(compiled, arguments, dim, slab)
            if ahead:
                self._open()
            self._summon(slabs if ahead else slabs - 1)

    def wake(self) -> None:
        """Wake the helpers, which takes a while, before there is something to do."""
        if self._knows_warp:
            with self._lock:
                self._summon(len(self._helpers))

    def _summon(self, count: int) -> None:
        """Have the first `count` helpers watch."""
        for n, helper in enumerate(self._helpers[:count]):
            if helper is None or helper.done():
                self._helpers[n] = self._pool.submit(self._watch, n + 1)

    def _lay_out(self, compiled: Compiled, arguments: Sequence[Any], dim: int, slab: int) -> int:
        """Lay a launch of several slabs on the desk; return how many."""
        packed = compiled.pack(arguments)
        slabs = -(-dim // slab)
        whole, last = compiled.bounds(slab), compiled.bounds(dim - slab * (slabs - 1))
        words, threads = self._words, len(self._helpers) + 1
        words[desk.ENTRY], words[desk.SLAB], words[desk.SLABS] = compiled.address, slab, slabs
        words[desk.ARGUMENTS], words[desk.SIZE] = ctypes.addressof(packed), ctypes.sizeof(packed)
        words[desk.WHOLE], words[desk.LAST] = ctypes.addressof(whole), ctypes.addressof(last)
        for n in range(threads):
            part = desk.PARTS + desk.LINE * n
            words[part], words[part + 1] = slabs * n // threads, slabs * (n + 1) // threads
        self._begun = (packed, whole, last, arguments)
        return slabs

    def _watch(self, part: int) -> None:
        """Help with launches until there has been none for a while."""
        self._help.prepared([self._desk, part, PATIENCE])()


def _aligned_words(count: int) -> np.ndarray[Any, Any]:
    """Return zeros that start with a cache line."""
    words = np.zeros(count + desk.LINE, np.int64)
    start = -words.ctypes.data // words.itemsize % desk.LINE
    return words[start : start + count]


def _takes_structs(source: str) -> bool:
    """Return whether Warp's compiled kernels take what we give them: bounds, and arguments as one struct."""
    name = f"{desk.lead_kernel.key}_\\w+"
    entry = rf"void ({name})_cpu_forward\(\s*wp::launch_bounds_t<1> \*\w+,\s*wp_args_\1 \*\w+\)"
    return re.search(rf"WP_API {entry}", source) is not None


def _address_of_yield() -> int | None:
    """Return the address of the system's function that lets another thread have the processor."""
    if sys.platform == "win32":
        function = ctypes.windll.kernel32.SwitchToThread
    else:
        function = ctypes.CDLL(None).sched_yield
    return ctypes.cast(function, ctypes.c_void_p).value
