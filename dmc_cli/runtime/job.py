"""Lay one launch at a time where others help with it: a thread's place in the worker pool."""

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import warp as wp

from dmc_cli.runtime import job_slots
from dmc_cli.runtime.compiled_kernel import CompiledKernel
from dmc_cli.stop import check_stop


class SlotKernels:
    """The compiled kernels of `job_slots.py`."""

    def __init__(self, board: Any) -> None:
        self.open = CompiledKernel(job_slots.open_kernel, [board, 0])
        self.lead = CompiledKernel(job_slots.lead_kernel, [board, 0, True])
        self.drop = CompiledKernel(job_slots.drop_kernel, [board, 0])
        self.help = CompiledKernel(job_slots.help_kernel, [board, 0, 0])


class JobSlot:
    """A slot on the board of job slots.

    Attributes:
        workers: How many the job has use for; 0 where there is no job.
        is_begun: Whether there is a job that nobody has seen done.
    """

    def __init__(self, board: Any, number: int, kernels: SlotKernels) -> None:
        self.workers = 0
        self.is_begun = False
        start = board.ptr + wp.types.type_size_in_bytes(wp.int64) * (
            job_slots.FIRST_SLOT + job_slots.SLOT * number
        )
        self._entries = (ctypes.c_int64 * job_slots.SLOT).from_address(start)
        self._board = board
        self._held: tuple[Any, ...] = ()  # what the job needs to stay in memory
        self._open = kernels.open.prepared([board, number])
        self._open_and_lead = kernels.lead.prepared([board, number, True])
        self._lead = kernels.lead.prepared([board, number, False])
        self._drop = kernels.drop.prepared([board, number])

    def lay(
        self, compiled: CompiledKernel, arguments: Sequence[Any], dim: int, chunk: int, threads: int
    ) -> None:
        """Lay a launch, cut into chunks of `chunk` indices, into the slot; it is not open yet."""
        packed = compiled.pack(arguments)
        chunks = -(-dim // chunk)
        whole, last = compiled.bounds(chunk), compiled.bounds(dim - chunk * (chunks - 1))
        job = self._entries
        job[job_slots.ENTRY], job[job_slots.CHUNK], job[job_slots.CHUNKS] = compiled.address, chunk, chunks
        job[job_slots.ARGUMENTS], job[job_slots.SIZE] = ctypes.addressof(packed), ctypes.sizeof(packed)
        job[job_slots.WHOLE], job[job_slots.LAST] = ctypes.addressof(whole), ctypes.addressof(last)
        job[job_slots.PART_COUNT] = min(threads, job_slots.MOST_PARTS)
        job[job_slots.WORKERS] = threads - 1
        self._held = (packed, whole, last, arguments)
        self.workers = min(threads, chunks) - 1

    def open(self) -> None:
        """Let workers begin with the job."""
        self.is_begun = True
        self._open()

    def run(self) -> None:
        """Open the job and wait until it is done."""
        self.is_begun = True
        self._see_done(self._open_and_lead)

    def finish(self) -> None:
        """Wait until the job that was opened is done, if there is one."""
        if self.is_begun:
            self._see_done(self._lead)

    def drop(self) -> None:
        """Drop what has not run yet of the job; when this returns, nobody works on it any more."""
        if self.is_begun:
            self._drop()
            self._forget()

    def _see_done(self, lead: Callable[[], None]) -> None:
        """Lead the job to its end, unless a signal's handler raises or the thread is asked to stop."""
        try:
            lead()
            while not self._entries[job_slots.DONE]:
                check_stop()
                self._lead()
        except BaseException:
            self.drop()
            raise
        self._forget()

    def _forget(self) -> None:
        self.is_begun = False
        self.workers = 0
        self._held = ()
