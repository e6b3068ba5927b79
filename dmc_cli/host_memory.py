"""Host memory that is kept for the next array of its size.

The system clears memory before it hands it out, page by page as it is touched; for a mesh that takes as long
as making its quads. So what an array leaves is kept and given to the next one, in the stages that follow and
for the next item of a batch.
"""

from collections import deque
from threading import Lock

import numpy as np

SMALLEST_KEPT = 1 << 12
"""Bytes below which the C library's own lists are as good."""

MOST_KEPT = 1 << 30
"""Bytes kept at most."""


class Block:
    """Memory and where it begins, which takes NumPy as long to tell as a small kernel runs."""

    __slots__ = ("address", "memory")

    def __init__(self, size: int) -> None:
        self.memory = np.empty(size, np.uint8)  # NumPy asks for huge pages
        self.address: int = self.memory.ctypes.data


class Lease:
    """A block of memory that goes back when this object does."""

    __slots__ = ("_returned", "block")

    def __init__(self, block: Block, returned: deque[Block]) -> None:
        self.block = block
        self._returned = returned

    def __del__(self) -> None:
        self._returned.append(self.block)  # only this, which is atomic: it may run anywhere, in any thread


class HostMemory:
    """The blocks that are kept, by their size."""

    def __init__(self) -> None:
        self._returned: deque[Block] = deque()
        self._kept: dict[int, list[Block]] = {}
        self._total = 0
        self._lock = Lock()

    def take(self, size: int) -> Lease:
        """Return an owner of at least `size` uninitialised bytes, its `block`."""
        if size < SMALLEST_KEPT:
            return Lease(Block(size), deque())
        rounded = block_size(size)
        with self._lock:
            self._collect()
            blocks = self._kept.get(rounded)
            if blocks:
                self._total -= rounded
                return Lease(blocks.pop(), self._returned)
        return Lease(Block(rounded), self._returned)

    def _collect(self) -> None:
        """Keep what came back since; let the largest go where that is too much."""
        while self._returned:
            block = self._returned.popleft()
            self._kept.setdefault(len(block.memory), []).append(block)
            self._total += len(block.memory)
        if self._total > MOST_KEPT:
            for size in sorted(self._kept, reverse=True):
                while self._total > MOST_KEPT and self._kept[size]:
                    self._total -= len(self._kept[size].pop().memory)


def block_size(size: int) -> int:
    """Return the size of block for `size` bytes: up to an eighth more, so that near sizes share blocks."""
    step = 1 << max(size.bit_length() - 4, 0)
    return -(-size // step) * step
