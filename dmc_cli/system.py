"""Do what operating systems do differently: each thing in one place, or done without.

Linux has all of it, macOS no affinity of processes, Windows neither that nor `resource`, `pthread_kill` and
locks on files (`files/atomic.py`).
"""

import errno
import os
import signal
import sys
from _thread import interrupt_main
from threading import main_thread

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

_NO_MEMORY = ("cannot allocate memory", "failed to map segment", "can't start new thread")
"""What loaders of libraries and of threads say where there is no memory for them."""

LEAST_ADDRESS_SPACE = 192 << 20
"""Bytes without which NumPy cannot be loaded."""

RSS_UNIT = 1 if sys.platform == "darwin" else 1024
"""Bytes in the unit of `ru_maxrss`: Linux counts kibibytes, macOS bytes."""


def usable_cores() -> int:
    """Return how many cores this process may use, or how many there are where that is not told."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def peak_memory() -> int | None:
    """Return the largest resident memory of this process so far, in bytes, or None where it is not told."""
    if resource is None:
        return None
    return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * RSS_UNIT


def check_address_space() -> None:
    """Raise MemoryError where a limit on memory is so low that NumPy's libraries would end the process."""
    if resource is None:
        return
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < LEAST_ADDRESS_SPACE:
        raise MemoryError(f"the limit set for it (ulimit -v) is {limit >> 20} MiB")


def lacks_memory(error: BaseException) -> bool:
    """Return whether an error means that the system gives no more memory, or no more threads."""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    return isinstance(error, (ImportError, OSError, RuntimeError)) and any(
        phrase in str(error).lower() for phrase in _NO_MEMORY
    )


def signal_main_thread(number: int) -> None:
    """Have the main thread's handler of a signal run, and wake that thread where the system can."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main_thread().ident or 0, number)
    else:
        interrupt_main(signal.Signals(number))


def let_system_reset(number: int) -> None:
    """Have the system give a signal its usual effect back as soon as its handler was called once.

    Python's handlers run between two steps of Python code. A second signal has to have its effect in the
    middle of a long one, too. Where the C library has no such call, it has it as soon as the step is over.
    """
    if sys.platform != "linux":
        return
    import ctypes

    library = ctypes.CDLL(None)
    if hasattr(library, "sysv_signal"):
        library.signal.restype = ctypes.c_void_p
        library.sysv_signal.restype = ctypes.c_void_p
        handler = library.signal(number, 0)  # Python's own, in C
        library.sysv_signal(number, ctypes.c_void_p(handler))
