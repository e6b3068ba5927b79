"""Keep host memory for the next array of its size.

The system clears memory before it hands it out, page by page as it is touched; for a mesh that takes as long
as making its quads. So what an array leaves is kept and given to the next one, in the stages that follow.

What is kept never makes the whole much larger than what was in use at some moment: a run takes as much memory
as its largest stage needs, whatever the stages before it left (`memory_budget.py` relies on it).
"""

import mmap
import os
from collections import deque
from contextlib import suppress
from threading import Lock

import numpy as np

from dmc_cli.array_types import ByteArray

SMALLEST_KEPT = 1 << 12
"""Bytes below which the C library's own lists are as good."""

MOST_KEPT = 1 << 30
"""Bytes kept at most."""

SMALL_WHOLE = 1 << 25
"""Bytes, in use and kept, that are never too much: to fetch small buffers anew costs more than it saves."""

SPARE_SHARE = 16
"""What is in use and kept may be more than what was in use at most by one part in so many."""

SMALLEST_MAPPED = 1 << 20
"""Bytes from which on memory is the system's own: what goes back to the C library may stay in the process."""

SMALLEST_HUGE = 1 << 22
"""Bytes from which on huge pages are asked for, as NumPy does."""

_LOCK = Lock()
"""Of all kept memory, and while the process forks: a child could not release it for another thread."""

if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_LOCK.acquire, after_in_parent=_LOCK.release, after_in_child=_LOCK.release)


class Buffer:
    """Memory and where it begins, which takes NumPy as long to tell as a small kernel runs."""

    __slots__ = ("address", "memory")

    def __init__(self, size: int) -> None:
        self.memory = mapped(size) if size >= SMALLEST_MAPPED else np.empty(size, np.uint8)
        self.address: int = self.memory.ctypes.data


class Lease:
    """A buffer of memory that goes back when this object does."""

    __slots__ = ("_returned", "buffer")

    def __init__(self, buffer: Buffer, returned: deque[Buffer]) -> None:
        self.buffer = buffer
        self._returned = returned

    def __del__(self) -> None:
        self._returned.append(self.buffer)  # only this, which is atomic: it may run anywhere, in any thread


class HostMemory:
    """The buffers that are kept, by their size, those that came back last at the end."""

    def __init__(self) -> None:
        self._returned: deque[Buffer] = deque()
        self._kept: dict[int, list[Buffer]] = {}
        self._total = 0
        self._in_use = 0
        self._most_in_use = 0

    def take(self, size: int) -> Lease:
        """Return an owner of at least `size` uninitialised bytes, its `buffer`."""
        if size < SMALLEST_KEPT:
            return Lease(Buffer(size), deque())
        rounded = buffer_size(size)
        with _LOCK:
            self._collect()
            buffer = self._kept_buffer(rounded) or self._new_buffer(rounded)
            self._in_use += rounded
            self._most_in_use = max(self._most_in_use, self._in_use)
        return Lease(buffer, self._returned)

    def let_go(self) -> None:
        """Keep nothing of what came back so far."""
        with _LOCK:
            self._collect()
            self._keep_at_most(0)

    @property
    def most_in_use(self) -> int:
        """Return the most bytes that were in use at the same time."""
        return self._most_in_use

    def _collect(self) -> None:
        """Keep what came back since."""
        while self._returned:
            buffer = self._returned.popleft()
            size = len(buffer.memory)
            buffers = self._kept.pop(size, [])
            buffers.append(buffer)
            self._kept[size] = buffers  # at the end
            self._total += size
            self._in_use -= size
        self._keep_at_most(MOST_KEPT)

    def _kept_buffer(self, size: int) -> Buffer | None:
        """Return a buffer of this size if one is kept."""
        buffers = self._kept.get(size)
        if not buffers:
            return None
        self._total -= size
        return buffers.pop()

    def _new_buffer(self, size: int) -> Buffer:
        """Return new memory, after letting go of so much that the whole is not too large with it."""
        in_use = self._in_use + size
        most = max(in_use, self._most_in_use)
        self._keep_at_most(max(most + most // SPARE_SHARE, SMALL_WHOLE) - in_use)
        try:
            return Buffer(size)
        except MemoryError:
            self._keep_at_most(0)
            return Buffer(size)

    def _keep_at_most(self, limit: int) -> None:
        """Let go of what came back first until no more than so many bytes are kept."""
        while self._total > limit:
            size = next(iter(self._kept))
            buffers = self._kept[size]
            while self._total > limit and buffers:
                self._total -= len(buffers.pop().memory)
            if not buffers:
                del self._kept[size]


def mapped(size: int) -> ByteArray:
    """Return new bytes, all 0, which the system has back as soon as nobody holds them.

    Raises:
        MemoryError: The system has none left.
    """
    if not hasattr(mmap, "MAP_ANONYMOUS"):  # as on Windows
        return np.zeros(size, np.uint8)
    try:
        mapping = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    except OSError as error:
        raise MemoryError(f"{size} bytes of memory were asked for: {error}") from error
    if size >= SMALLEST_HUGE and hasattr(mmap, "MADV_HUGEPAGE"):
        with suppress(OSError):  # a kernel without them
            mapping.madvise(mmap.MADV_HUGEPAGE)
    return np.frombuffer(mapping, np.uint8)


def buffer_size(size: int) -> int:
    """Return the size of buffer for `size` bytes: up to an eighth more, so that near sizes share buffers."""
    step = 1 << max(size.bit_length() - 4, 0)
    return -(-size // step) * step
