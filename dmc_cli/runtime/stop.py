"""Ask other threads to stop: what they do ends with an exception at its next check.

A signal raises an exception in the main thread alone. What runs in others therefore checks an event of its
own: before and during launches, between stages, and between the pieces of what is read or written.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, local

_thread = local()


class StopRequested(BaseException):
    """Somebody asked this thread to stop; no handler of ordinary errors may swallow it."""


@contextmanager
def stopping_on(event: Event) -> Iterator[None]:
    """Let `check_stop` raise in this thread once the event is set."""
    _thread.event = event
    try:
        yield
    finally:
        del _thread.event


def check_stop() -> None:
    """Raise if this thread was asked to stop.

    Raises:
        StopRequested: It was.
    """
    event: Event | None = getattr(_thread, "event", None)
    if event is not None and event.is_set():
        raise StopRequested
