"""Share a launch among the CPU's threads.

Warp runs a launch on one core, and to wake a thread for the half of it takes a hundred microseconds, as long
as many a launch. So the pool calls the compiled kernels itself, chunk by chunk: its workers watch for
launches from native code (`job_slots.py`), without the interpreter's lock, and sleep only when there has been
none for a while. Which thread works on which chunk never shows in the result: no kernel hands out slots by
atomics.

There is one pool a process. It grows to as many workers as launches ask for, or as the system allows; threads
that launch at the same time share them. Whoever launches returns to the interpreter every 50 ms; if a signal
raises an exception there, what is left of the launch is dropped.
"""

import ctypes
import os
import sys
import time
import weakref
from collections.abc import Sequence
from queue import SimpleQueue
from threading import Lock, Thread, local
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.runtime import job_slots
from dmc_cli.runtime.compiled_kernel import (
    KNOWN_VERSIONS,
    OTHER_RECORDS,
    CompiledKernel,
    is_known_version,
    takes_structs,
)
from dmc_cli.runtime.job import JobSlot, SlotKernels
from dmc_cli.runtime.warp_launch import launch_by_warp
from dmc_cli.stop import EVENTS, check_stop
from dmc_cli.system import usable_cores

CHUNKS_PER_THREAD = 64
"""Chunks a thread at most, in short launches: enough to even out where the surface is dense."""

LONGEST_CHUNK = 64
"""Grains a chunk at most: milliseconds, so that nobody has to wait long for its end."""

PATIENCE = 6000
"""Looks at all slots, without a job in any, after which a worker sleeps: two milliseconds where nobody else
wants the processor."""

_BY_WARP = "CPU launches run on one thread"

SHORT, LONG = 0.02, 0.1
"""Seconds between which the pieces of a launch by Warp itself are kept."""


class Worker:
    """A thread that helps when it is woken, and sleeps when there has been nothing to do for a while.

    Raises:
        RuntimeError: The system allows no more threads.
    """

    def __init__(self, number: int, board: Any, kernels: SlotKernels) -> None:
        self.is_awake = False
        self._calls: SimpleQueue[bool] = SimpleQueue()
        self._help = kernels.help.prepared([board, number, PATIENCE])
        self._thread = Thread(target=self._work, name=f"dmc-{number}", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Have the worker look for jobs; the caller has seen that it sleeps."""
        self.is_awake = True
        self._calls.put(True)

    def end(self) -> None:
        """Wait until the thread has ended; the board tells it to stop."""
        self._calls.put(False)
        self._thread.join()

    def _work(self) -> None:
        while self._calls.get():
            self._help()
            self.is_awake = False


class WorkerPool:
    """All CPU threads that help those who launch.

    Attributes:
        fallback: Why all launches are Warp's own, on one thread; None where the pool shares them.
    """

    def __init__(self) -> None:
        self._workers: list[Worker] = []
        self._most_workers = sys.maxsize
        self._slots: list[JobSlot] = []
        self._free_slots: list[JobSlot] = []
        self._compiled: dict[Any, CompiledKernel] = {}
        self._lock = Lock()
        self._thread = local()
        self._board = make_board()
        self._kernels, self.fallback = _slot_kernels(self._board)
        self._end = weakref.finalize(self, _end, self._board, self._workers)

    def launch(
        self, kernel: Any, dim: int, arguments: Sequence[Any], threads: int, grain: int, longest: int = 0
    ) -> None:
        """Run a kernel for thread indices 0 to `dim` - 1, in chunks that several threads share.

        Args:
            kernel: A kernel of one dimension; its first argument is the index of a chunk's first thread.
            dim: At least 1.
            arguments: The kernel's, the first one 0.
            threads: CPU threads at most; if 1, the chunks are done in their order.
            grain: Indices a chunk at least.
            longest: Indices a chunk at most; 64 grains if 0.
        """
        if EVENTS:
            check_stop()
        if self.fallback:
            launch_in_pieces(kernel, dim, arguments, longest or grain)
            return
        slot = self.slot
        if slot.is_begun:
            slot.finish()
        compiled = self._compiled.get(kernel) or self._compile(kernel, arguments)
        is_short = dim < 2 * grain and not longest  # what `chunk_size` would tell, sooner
        chunk = dim if is_short else chunk_size(dim, threads, grain, longest)
        if chunk == dim:
            compiled.prepared(arguments, dim)()
            return
        slot.lay(compiled, arguments, dim, chunk, threads)
        self._summon(slot)
        slot.run()

    def begin(self, kernel: Any, dim: int, arguments: Sequence[Any], threads: int, grain: int) -> None:
        """Begin what `launch` does: workers are at it while the caller gets the next launch ready.

        The caller's next launch, or `finish`, sees it done; until then nobody looks at its arrays.
        """
        chunk = chunk_size(dim, threads, grain)
        if threads == 1 or chunk == dim or self.fallback:
            self.launch(kernel, dim, arguments, threads, grain)
            return
        check_stop()
        slot = self.slot
        slot.finish()
        compiled = self._compiled.get(kernel) or self._compile(kernel, arguments)
        slot.lay(compiled, arguments, dim, chunk, threads)
        slot.workers = min(slot.workers + 1, threads - 1)  # one in the caller's place
        slot.open()
        self._summon(slot)

    def finish(self) -> None:
        """Wait until the launch that the calling thread has begun is done."""
        if not self.fallback:
            self.slot.finish()

    def drop(self) -> None:
        """Drop what has not run yet of the launch that the calling thread has begun."""
        if not self.fallback:
            self.slot.drop()

    def wake(self, threads: int) -> None:
        """Wake the workers, which takes a while, before there is something to do."""
        if not self.fallback:
            self._wake(threads - 1)

    @property
    def slot(self) -> JobSlot:
        """Return the job slot of the calling thread."""
        try:
            slot: JobSlot = self._thread.slot
        except AttributeError:
            slot = self._take_slot()
        return slot

    def leave_to_parent(self) -> None:
        """Do nothing with the workers any more: in a forked child they are not there."""
        self._end.detach()

    def _take_slot(self) -> JobSlot:
        """Give the calling thread a slot, for as long as it lives."""
        assert self._kernels is not None
        with self._lock:
            number = len(self._slots)
            if self._free_slots:
                slot = self._free_slots.pop()
            elif number < job_slots.MOST_SLOTS:
                slot = JobSlot(self._board, number, self._kernels)
                self._slots.append(slot)
                self._board.numpy()[job_slots.SLOT_COUNT] = number + 1
            else:
                slot = JobSlot(make_board(), 0, self._kernels)  # where no worker looks
        self._thread.slot, self._thread.lease = slot, _Lease(slot, self._free_slots)
        return slot

    def _compile(self, kernel: Any, arguments: Sequence[Any]) -> CompiledKernel:
        compiled = self._compiled[kernel] = CompiledKernel(kernel, arguments)
        return compiled

    def _summon(self, slot: JobSlot) -> None:
        """Wake as many workers as all open jobs have use for."""
        wanted = slot.workers
        if len(self._slots) > 1:
            others = sum(other.workers for other in self._slots if other is not slot)
            wanted = min(wanted + others, max(wanted, usable_cores() - 1))
        self._wake(wanted)

    def _wake(self, count: int) -> None:
        """Wake the first `count` workers."""
        if count > len(self._workers):
            self._grow(count)
        for worker in self._workers[:count]:
            if not worker.is_awake:
                worker.wake()

    def _grow(self, count: int) -> None:
        """Make workers until there are `count`, or as many as the system allows."""
        assert self._kernels is not None
        with self._lock:
            while len(self._workers) < min(count, self._most_workers):
                try:
                    self._workers.append(Worker(len(self._workers) + 1, self._board, self._kernels))
                except RuntimeError:
                    self._most_workers = len(self._workers)


class _Lease:
    """A thread's hold on a slot, which ends with the thread."""

    def __init__(self, slot: JobSlot, free: list[JobSlot]) -> None:
        self.slot = slot
        self._free = free

    def __del__(self) -> None:
        self._free.append(self.slot)


def chunk_size(dim: int, threads: int, grain: int, longest: int = 0) -> int:
    """Return how many indices of a launch are one chunk."""
    most = longest or LONGEST_CHUNK * grain
    if threads > 1:
        most = min(most, max(-(-dim // (CHUNKS_PER_THREAD * threads)), -(-dim // max(dim // grain, 1))))
    return min(most, dim)


def launch_in_pieces(kernel: Any, dim: int, arguments: Sequence[Any], size: int) -> None:
    """Run a kernel as `WorkerPool.launch` does, by Warp's launches, on one thread; the first has `size`."""
    done = 0
    while done < dim:
        count = min(size, dim - done)
        start = time.perf_counter()
        launch_by_warp(kernel, count, [done, *arguments[1:]], "cpu")
        took = time.perf_counter() - start
        done += count
        if took > LONG:
            size = max(size // 2, 1)
        elif took < SHORT:
            size *= 2
        check_stop()


def make_board() -> Any:
    """Return a board without jobs, int64 (BOARD,), at the start of a cache line."""
    entries = np.zeros(job_slots.BOARD + job_slots.LINE, np.int64)
    start = -entries.ctypes.data // entries.itemsize % job_slots.LINE  # the first cache line's
    entries = entries[start : start + job_slots.BOARD]
    entries[job_slots.YIELD] = _address_of_yield()
    entries[job_slots.CLOCK], entries[job_slots.CLOCK_ID] = _clock()
    board = wp.array(ptr=entries.ctypes.data, dtype=wp.int64, shape=entries.shape, device="cpu", copy=False)
    board._source = entries
    return board


def _slot_kernels(board: Any) -> tuple[SlotKernels | None, str | None]:
    """Return the kernels of job slots, or None and why this version of Warp cannot be called by them."""
    if not is_known_version():
        known = " and ".join(KNOWN_VERSIONS)
        return None, f"{_BY_WARP} (Warp {wp.config.version} is not known, only {known})"
    try:
        kernels = SlotKernels(board)
        if takes_structs(kernels.lead.source, job_slots.lead_kernel.key):
            return kernels, None
        found = "its compiled kernels do not take bounds and one struct"
    except OTHER_RECORDS as error:
        found = f"its record of a launch is not as expected: {error}"
    return None, f"{_BY_WARP} (Warp {wp.config.version}: {found})"


def _end(board: Any, workers: Sequence[Worker]) -> None:
    """End a pool's workers."""
    board.numpy()[job_slots.STOPPED] = 1
    for worker in workers:
        worker.end()


def _address_of_yield() -> int:
    """Return the address of the system's function that lets another thread have the processor."""
    if sys.platform == "win32":
        function = ctypes.windll.kernel32.SwitchToThread
    else:
        function = ctypes.CDLL(None).sched_yield
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def _clock() -> tuple[int, int]:
    """Return the address of the system's function that tells the time, and the clock's number, or -1."""
    if sys.platform == "win32":
        function, clock = ctypes.windll.kernel32.GetTickCount64, -1
    else:
        function, clock = ctypes.CDLL(None).clock_gettime, time.CLOCK_MONOTONIC
    return ctypes.cast(function, ctypes.c_void_p).value or 0, clock


_making = Lock()
_pool: WorkerPool | None = None


def worker_pool() -> WorkerPool:
    """Return the process's pool."""
    global _pool  # noqa: PLW0603 - one per process
    if _pool is None:
        with _making:
            if _pool is None:
                _pool = WorkerPool()
    return _pool


def _forget_pool() -> None:
    """Have a forked child make a pool of its own: its parent's threads are not there."""
    global _pool, _making
    if _pool is not None:
        _pool.leave_to_parent()
    _pool, _making = None, Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)
