"""Turn signals into exceptions, so that every `with` on the way out cleans up."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from types import FrameType
from typing import Any

from dmc_cli.system import let_system_reset, signal_main_thread

_SIGNALS = (signal.SIGINT, signal.SIGTERM)

_LATER = 0.01
"""Seconds until a signal is raised again that was swallowed."""


class Stopped(BaseException):
    """SIGINT or SIGTERM arrived; no handler of ordinary errors may swallow it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number
        self.message = "interrupted" if number == signal.SIGINT else "terminated"
        self.message += "; no output was left incomplete"
        self.exit_status = 128 + number
        """As a shell reports it: 130 or 143."""


class _Handler:
    """The handler of both signals: the first one is an exception, a second one has its usual effect."""

    def __init__(self) -> None:
        self._held: list[int] | None = None
        self._again: Timer | None = None

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        """Raise `Stopped`, or note the signal where none may be raised."""
        die_on_signals()
        if self._again is not None:
            self._again.cancel()
        if self._held is None:
            raise Stopped(number)
        self._held.append(number)

    def arm(self) -> None:
        """Handle a signal; a second one has its usual effect: it may come where Python runs no handlers."""
        for number in _SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup and `&` ask
                signal.signal(number, self)
                let_system_reset(number)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Raise at the end of the context what arrives within it."""
        held: list[int] = []
        self._held = held
        try:
            yield
        finally:
            self._held = None
        if held:
            raise Stopped(held[0])

    def raising_again(self, usual: Callable[[Any], Any]) -> Callable[[Any], None]:
        """Return a hook for exceptions that Python swallows: in destructors and callbacks of weak references.

        A signal that came just there would be lost; it is raised once more, when they have ended, or kills at
        once where no thread can be started to do so.
        """

        def hook(unraisable: Any) -> None:
            if not isinstance(unraisable.exc_value, Stopped):
                usual(unraisable)
                return
            number = unraisable.exc_value.number
            self.arm()
            self._again = Timer(_LATER, signal_main_thread, [number])  # wakes it, too
            self._again.daemon = True
            try:
                self._again.start()
            except RuntimeError:  # no thread can be started
                die_on_signals()
                signal_main_thread(number)

        return hook


_handler = _Handler()


def raise_on_signals() -> None:
    """Let SIGINT and SIGTERM raise `Stopped` in the main thread from now on; a second one kills at once."""
    _handler.arm()
    sys.unraisablehook = _handler.raising_again(sys.unraisablehook)


@contextmanager
def signals_held() -> Iterator[None]:
    """Raise at the end of the context a signal that arrives within it; a second one kills as ever."""
    with _handler.held():
        yield


def die_on_signals() -> None:
    """Let SIGINT and SIGTERM kill at once from now on: nothing has to be cleaned up."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
