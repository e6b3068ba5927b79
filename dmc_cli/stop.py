"""Ask other threads to stop: what they do ends with an exception at its next check.

A signal raises an exception in the main thread alone. What runs in others therefore checks an event of its
own: before and during launches, between stages, and between the pieces of what is read or written.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, get_ident

EVENTS: dict[int, Event] = {}
"""By the number of each thread that may be asked to stop; mostly there is none, which is soon looked up."""


class StopRequested(BaseException):
    """Somebody asked this thread to stop; no handler of ordinary errors may swallow it."""


@contextmanager
def stopping_on(event: Event) -> Iterator[None]:
    """Let `check_stop` raise in this thread once the event is set."""
    EVENTS[get_ident()] = event
    try:
        yield
    finally:
        del EVENTS[get_ident()]


def check_stop() -> None:
    """Raise if this thread was asked to stop.

    Raises:
        StopRequested: It was.
    """
    event = EVENTS.get(get_ident())
    if event is not None and event.is_set():
        raise StopRequested
