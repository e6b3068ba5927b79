"""Choose a device, and launch kernels on it in the one way there is.

Conventions: every kernel is one-dimensional and takes `first`, the index of its first thread, as its
first argument, so that on CPU a launch can be cut into chunks, which threads share (`worker_pool.py`).
"""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from math import prod
from types import ModuleType
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.errors import DeviceError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.runtime import job_slots, prefix_sums
from dmc_cli.runtime.arrays import array_over, size_of, view
from dmc_cli.runtime.buffer_pool import SMALLEST_MAPPED, HostMemory, mapped
from dmc_cli.runtime.compiled_kernel import LOADING
from dmc_cli.runtime.kernel_cache import compile_modules, load_compiled, usable_cache
from dmc_cli.runtime.prefix_sums import CHUNK, scan_chunks_kernel, scan_rows_kernel, sum_chunks_kernel
from dmc_cli.runtime.warp_launch import launch_by_warp
from dmc_cli.runtime.worker_pool import worker_pool
from dmc_cli.settings import check_run
from dmc_cli.system import lacks_memory, usable_cores

MOST_ITEMS = 2**31 - 1
"""Most vertices or quads: mesh indices are int32, as every mesh format and Warp itself have them."""

SHORT_SCAN = 8 * CHUNK
"""Counts that one thread sums on CPU while others would get ready."""

ROWS_A_CHUNK = 64
ITEMS_A_CHUNK = 256
FLAGS_A_CHUNK = 2048
"""Rows, single cells, vertices or quads, and those that are only flagged or copied, a chunk at least: some
ten microseconds of work, which is what it costs to have a second thread."""


@dataclass(frozen=True)
class Device:
    """A Warp device and the number of CPU threads that share its launches; a copy counts its own arrays."""

    name: str
    threads: int = 1
    _memory: HostMemory = field(default_factory=HostMemory, init=False, repr=False, compare=False)
    _nothings: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def is_cpu(self) -> bool:
        """Return whether kernels run on the CPU."""
        return self.name == "cpu"

    @property
    def span(self) -> int:
        """Return the items that a kernel's thread may go through: to start one takes 10 ns on CPU."""
        return 32 if self.is_cpu else 1

    @property
    def most_in_use(self) -> int | None:
        """Return the most bytes of arrays at the same time that `empty` made here; None on CUDA."""
        return self._memory.most_in_use if self.is_cpu else None

    def _nothing(self, dtype: Any) -> Any:
        """Return the array without items of a type, which all share."""
        if dtype not in self._nothings:
            self._nothings[dtype] = wp.empty(0, dtype=dtype, device=self.name)
        return self._nothings[dtype]

    def wake(self) -> None:
        """Get threads ready, which takes as long as a short launch, before the first of many."""
        if self.is_cpu:
            worker_pool().wake(self.threads)

    def launch(
        self,
        kernel: Any,
        dim: int,
        inputs: Sequence[Any],
        outputs: Sequence[Any],
        grain: int = ROWS_A_CHUNK,
        longest: int = 0,
    ) -> None:
        """Run `kernel` for thread indices 0 to `dim` - 1; its first argument `first` is supplied here.

        On CPU a chunk has at least `grain` of them, enough work to outweigh the cost of a launch, and at most
        `longest`, if that is given: where an item takes long, few enough that nobody waits long for a chunk.
        """
        if dim == 0:
            return
        arguments = [0, *inputs, *outputs]
        if self.is_cpu:
            worker_pool().launch(kernel, dim, arguments, self.threads, grain, longest)
        else:
            launch_by_warp(kernel, dim, arguments, self.name)

    def launch_whole(
        self, kernel: Any, dim: int, inputs: Sequence[Any], outputs: Sequence[Any], grain: int = ITEMS_A_CHUNK
    ) -> None:
        """Run `kernel` as `launch` does, but on CPU without sharing it: one thread index after the other.

        Needed where threads write to the same item, by atomics: on CPU Warp makes plain loads and stores of
        them, of which some would be lost if several CPU threads ran chunks at once. The one CPU thread looks
        after signals between stretches of 64 grains. On CUDA it is `launch`.
        """
        if self.is_cpu and dim:
            worker_pool().launch(kernel, dim, [0, *inputs, *outputs], 1, grain)
        else:
            self.launch(kernel, dim, inputs, outputs)

    def begin(
        self, kernel: Any, dim: int, inputs: Sequence[Any], outputs: Sequence[Any], grain: int = ROWS_A_CHUNK
    ) -> None:
        """Begin a launch, which goes on while the caller gets the next one ready, as all do on CUDA.

        The thread's next launch waits for it; before the host looks at its arrays, `finish` does.
        """
        if self.is_cpu and dim:
            worker_pool().begin(kernel, dim, [0, *inputs, *outputs], self.threads, grain)
        else:
            self.launch(kernel, dim, inputs, outputs, grain)

    def finish(self) -> None:
        """Wait for the launch that was begun, if there is one."""
        if self.is_cpu:
            worker_pool().finish()

    def drop(self) -> None:
        """Leave undone what is left of the launch that was begun, if there is one."""
        if self.is_cpu:
            worker_pool().drop()

    def empty(self, shape: int | tuple[int, ...], dtype: Any) -> Any:
        """Return an uninitialised array; every kernel that gets it writes all of it.

        On CPU the memory is our own (`buffer_pool.py`), on CUDA Warp's pool keeps it.
        """
        if shape == 0:
            return self._nothing(dtype)
        if not self.is_cpu:
            return wp.empty(shape, dtype=dtype, device=self.name)
        lease = self._memory.take(prod(_dims(shape)) * size_of(dtype))
        return array_over(lease.buffer.address, lease, dtype, shape)

    def let_go(self) -> None:
        """Return the memory of arrays that are gone to the system: what follows needs other sizes."""
        self._memory.let_go()

    def zeros(self, shape: int | tuple[int, ...], dtype: Any) -> Any:
        """Return an array of zeros; on CPU a page of it costs nothing until it is written to."""
        if not self.is_cpu:
            return wp.zeros(shape, dtype=dtype, device=self.name)
        size = prod(_dims(shape)) * size_of(dtype)
        buffer = mapped(size) if size >= SMALLEST_MAPPED else np.zeros(size, np.uint8)
        return array_over(buffer.ctypes.data, buffer, dtype, shape)

    def clear_around(self, array: Any, start: int, end: int) -> None:
        """Set all items but `start` to `end` - 1 of an array to zero."""
        if self.is_cpu:  # a tenth of the time that Warp takes to make a view
            host = array.numpy()
            host[:start] = 0
            host[end:] = 0
        else:
            array[:start].zero_()
            array[end:].zero_()

    def starts(self, counts: Any) -> tuple[Any, int]:
        """Return the exclusive prefix sum of int64 `counts` with the total as a last item, and the total.

        The total is what a stage reads from the device: the size of what the next kernel emits.

        Raises:
            DeviceError: The total does not fit into the 32 bits of a mesh index.
        """
        length = counts.shape[0]
        sums = self.empty(length + 1, wp.int64)
        if self.is_cpu:
            self._scan(counts.ptr or 0, 1, length, sums.ptr)
        else:
            _scan_on_gpu(counts, sums)
        return sums, mesh_size(_last(sums))

    def starts_of_rows(self, counts: Any) -> list[tuple[Any, int]]:
        """Return what `starts` does for each row of int64 counts [row, n], whatever the totals."""
        rows, length = counts.shape
        sums = self.empty((rows, length + 1), wp.int64)
        if self.is_cpu:
            size = sums.strides[0]
            parts = [view(sums, wp.int64, length + 1, size * row) for row in range(rows)]
            self._scan(counts.ptr or 0, rows, length, sums.ptr)
            totals = sums.numpy()[:, length].tolist()
        else:
            parts = [sums[row] for row in range(rows)]
            for row, part in enumerate(parts):
                _scan_on_gpu(counts[row], part)
            totals = [_last(part) for part in parts]
        return list(zip(parts, totals, strict=True))

    def _scan(self, counts: int, rows: int, length: int, sums: int) -> None:
        """Write the exclusive prefix sums of rows of counts at an address, their totals as last items."""
        if length < SHORT_SCAN:
            self.launch(scan_rows_kernel, rows, [counts, length], [sums], rows)
            return
        chunks = -(-length // CHUNK)
        chunk_sums = self.empty(rows * chunks, wp.int64)
        starts = self.empty(rows * (chunks + 1), wp.int64)
        self.launch(sum_chunks_kernel, rows * chunks, [counts, length, chunks], [chunk_sums], 1)
        self._scan(chunk_sums.ptr, rows, chunks, starts.ptr)
        self.launch(scan_chunks_kernel, rows * chunks, [counts, length, chunks, starts], [sums], 1)

    def totals(self, counts: Any) -> list[int]:
        """Return the sum of each row of an integer array, (rows, n)."""
        sums: list[int] = counts.numpy().sum(axis=1, dtype=np.int64).tolist()
        return sums

    def total(self, counts: Any) -> int:
        """Return the sum of an integer array as a Python integer."""
        host = counts.numpy()
        return int(host.sum(dtype=np.int64)) if np.count_nonzero(host) else 0  # of rare things: mostly none


def _scan_on_gpu(counts: Any, sums: Any) -> None:
    """Write the exclusive prefix sum of counts on a GPU, their total as a last item."""
    sums[:1].zero_()
    if counts.shape[0]:
        wp.utils.array_scan(counts, sums[1:], inclusive=True)


def _last(sums: Any) -> int:
    """Return the last item of an array, all that is copied from a GPU."""
    end = sums if sums.device.is_cpu else sums[sums.shape[0] - 1 :]
    return int(end.numpy()[-1])


def mesh_size(total: int) -> int:
    """Return a number of vertices or quads, if a mesh can have so many.

    Raises:
        DeviceError: It does not fit into the 32 bits of a mesh index.
    """
    if total > MOST_ITEMS:
        raise DeviceError(
            f"the surface has {total} vertices or quads, but 32-bit mesh indices number only"
            f" {MOST_ITEMS}; crop or downsample the volume"
        )
    return total


def _dims(shape: int | tuple[int, ...]) -> tuple[int, ...]:
    """Return a shape as a tuple."""
    return (shape,) if isinstance(shape, int) else shape


def load_kernels(device: Device, modules: Sequence[ModuleType], progress: Progress = SILENT) -> None:
    """Load the kernels of modules, compiling those that the cache does not hold whole, and say so.

    Args:
        device: Where they will run.
        modules: Python modules with kernels.
        progress: Who listens.

    Raises:
        WriteError: Kernels have to be compiled, and the cache cannot be written.
        MemoryError: There is no memory for them.
    """
    block_dim = 1 if device.is_cpu else None
    needed = dict.fromkeys([job_slots, prefix_sums, *modules] if device.is_cpu else modules)
    names = [wp.get_module(module.__name__) for module in needed]
    with LOADING, usable_cache():
        missing = load_compiled(device.name, names, block_dim)
    if missing:
        shown = f"compiling {len(missing)} kernel modules, once for this version"
        with progress.stage(shown), LOADING, usable_cache():
            compile_modules(device.name, missing, block_dim, device.threads)
    if device.is_cpu and (reason := worker_pool().fallback):
        progress.note(reason)


def launch_fallback() -> str | None:
    """Return why launches on CPU run on one thread, or None where they do not.

    Raises:
        WriteError: The kernels that share a launch have to be compiled, and the cache cannot be written.
        MemoryError: There is no memory for them.
    """
    load_kernels(Device("cpu"), [])
    return worker_pool().fallback


def initialize_warp() -> None:
    """Start Warp, once a process, without its greeting and its remark that there is no GPU driver.

    Raises:
        WriteError: The kernel cache cannot be made.
        DeviceError: Warp does not work on this system.
        MemoryError: There is no memory for it.
    """
    with LOADING:  # two threads at it would take standard error from each other
        _start_warp()


@cache
def _start_warp() -> None:
    """Start Warp; meanwhile nothing that anybody writes to standard error is seen."""
    wp.config.log_level = wp.LOG_WARNING
    sys.stderr.flush()
    kept = os.dup(2)
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 2)  # the remark comes from native code
    try:
        with usable_cache():
            wp.init()
    except RuntimeError as error:  # a library of Warp's cannot be loaded
        cause = error.__cause__ or error
        if lacks_memory(cause):
            raise MemoryError(str(cause)) from error
        raise DeviceError(
            f"Warp, which runs the kernels, cannot be started ({cause}); expected a working installation; see"
            " `dmc doctor`, or install warp-lang again"
        ) from error
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(silence)


def select_device(name: str = "auto", threads: int | None = None) -> Device:
    """Return the device that `name` asks for: auto, cpu, cuda or cuda:N.

    `threads` is the number of CPU threads, all cores if None.

    Raises:
        SettingsError: No device, or no number of threads.
        DeviceError: There is no such device.
    """
    check_run(name, threads)
    initialize_warp()
    cuda = wp.is_cuda_available()
    count = int(threads or usable_cores())
    if name == "cpu" or (name == "auto" and not cuda):
        return Device("cpu", count)
    if not cuda:
        raise DeviceError(
            f"device {name!r} was asked for, but no usable CUDA device was found; expected an NVIDIA GPU"
            " with a driver; use --device cpu or --device auto"
        )
    index = int(name.partition(":")[2] or 0)
    present = wp.get_cuda_device_count()
    if index >= present:
        raise DeviceError(
            f"device {name!r} was asked for, but only {present} CUDA device(s) were found; use cuda:0"
        )
    return Device(f"cuda:{index}", count)
