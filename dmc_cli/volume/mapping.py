"""Map files into memory, and see to what happens where one shrinks while it is looked at.

A page that the file no longer has, or that cannot be read, is a SIGBUS for whichever thread looks at it,
those of the kernels among them. On Linux a handler puts zeros in place of the rest of the mapping, so that
thread goes on, and the loss is told where the work is done (`intact`). The signal strikes at a load from the
mapping, in a kernel or a loop of NumPy's, so neither the interpreter nor an allocator is at work in that
thread just then, and the handler may be Python. A SIGBUS elsewhere has the effect that it had before.
"""

import ctypes
import mmap
import platform
import signal
import sys
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any, BinaryIO

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError

_KNOWS_HANDLERS = sys.platform == "linux" and platform.machine() in ("x86_64", "aarch64")
"""Whether the structures below are the system's."""

_ADDRESS = 16
"""Where siginfo_t holds the address that was looked at."""

_SA_SIGINFO = 4

_ZEROS = 0x02 | 0x10 | 0x20
"""MAP_PRIVATE, MAP_FIXED, MAP_ANONYMOUS: pages of zeros in place of what is there."""

_HANDLER = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)


class MappedFile(mmap.mmap):
    """A whole file, mapped to be read.

    Attributes:
        has_holes: Whether a part of it was looked at that the file did not have any more.
    """

    has_holes = False

    @property
    def is_lost(self) -> bool:
        """Return whether the file did not keep all that was mapped."""
        return self.has_holes or self.size() < len(self)


class _Action(ctypes.Structure):
    """The C library's `struct sigaction`."""

    _fields_ = (
        ("handler", ctypes.c_void_p),
        ("mask", ctypes.c_uint8 * 128),
        ("flags", ctypes.c_int),
        ("restorer", ctypes.c_void_p),
    )


class _Watch:
    """The handler of SIGBUS and the mappings that it knows, by their address."""

    def __init__(self) -> None:
        self._mappings: dict[int, tuple[int, weakref.ref[MappedFile]]] = {}
        self._lock = Lock()
        self._library: Any = None
        self._before = _Action()
        self._function: Any = None

    def add(self, mapping: MappedFile) -> None:
        """Know a mapping for as long as it is there."""
        start = np.frombuffer(mapping, np.uint8).ctypes.data
        with self._lock:
            if self._library is None:
                self._begin()
            self._mappings[start] = len(mapping), weakref.ref(mapping)
        weakref.finalize(mapping, self._forget, start).atexit = False

    def _forget(self, start: int) -> None:
        found = self._mappings.get(start)
        if found is not None and found[1]() is None:
            self._mappings.pop(start, None)

    def _begin(self) -> None:
        library = ctypes.CDLL(None)
        library.mmap.restype = ctypes.c_void_p
        library.mmap.argtypes = (ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long)
        library.sigaction.argtypes = (ctypes.c_int, ctypes.POINTER(_Action), ctypes.POINTER(_Action))
        self._function = _HANDLER(self._strike)
        action = _Action(handler=ctypes.cast(self._function, ctypes.c_void_p), flags=_SA_SIGINFO)
        self._library = library
        library.sigaction(signal.SIGBUS, ctypes.byref(action), ctypes.byref(self._before))

    def _strike(self, number: int, info: int, _context: int) -> None:
        """Put zeros in the place of what is gone; what is not ours strikes again and is not ours then."""
        address = ctypes.c_void_p.from_address(info + _ADDRESS).value or 0
        for start, (size, known) in list(self._mappings.items()):
            mapping = known()
            if mapping is not None and start <= address < start + size:
                mapping.has_holes = True
                page = address - (address - start) % mmap.PAGESIZE
                rest = start + size - page
                if self._library.mmap(page, rest, mmap.PROT_READ, _ZEROS, -1, 0) == page:
                    return
        self._library.sigaction(number, ctypes.byref(self._before), None)


_WATCH = _Watch()


def map_file(file: BinaryIO) -> MappedFile | None:
    """Map a file to be read, or return None where that cannot be done."""
    try:
        mapping = MappedFile(file.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError):
        return None
    if _KNOWS_HANDLERS:
        _WATCH.add(mapping)
    return mapping


def mapped_file(values: AnyArray) -> mmap.mmap | None:
    """Return the mapping that values lie in, ours or a caller's, behind whatever views there are of it."""
    owner: Any = values
    while isinstance(owner, (np.ndarray, memoryview)):
        owner = owner.base if isinstance(owner, np.ndarray) else owner.obj
    return owner if isinstance(owner, mmap.mmap) else None


@contextmanager
def intact(values: AnyArray, name: str) -> Iterator[None]:
    """Raise at the end, whatever else went wrong, if the values' file did not stay as it was.

    Args:
        values: They may lie in a mapped file.
        name: The input as the user named it.

    Raises:
        DamagedVolumeError: The file shrank, or could not be read.
    """
    mapping = mapped_file(values)
    if not isinstance(mapping, MappedFile):
        yield
        return
    try:
        yield
    except Exception as error:
        if mapping.is_lost:
            raise _lost(name) from error
        raise
    if mapping.is_lost:
        raise _lost(name)


def _lost(name: str) -> DamagedVolumeError:
    return DamagedVolumeError(
        f"{name}: the file became shorter, or could not be read, while it was in use; expected it to stay as"
        " it was; wait until it is complete, or copy it to where nobody changes it"
    )
