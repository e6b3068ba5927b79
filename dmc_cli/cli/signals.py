"""Signals as exceptions, so that every `with` on the way out cleans up."""

import signal
import sys
from collections.abc import Callable
from threading import Timer
from types import FrameType
from typing import Any

from dmc_cli.system import signal_main_thread

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


def raise_on_signals() -> None:
    """From now on SIGINT and SIGTERM raise `Stopped` in the main thread; a second one kills at once."""

    # a second signal, and one after the end of the run, has its usual effect
    def handle(number: int, _frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise Stopped(number)

    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup and `&` ask
            signal.signal(number, handle)
    sys.unraisablehook = _raising_again(handle, sys.unraisablehook)


def _raising_again(
    handle: Callable[[int, FrameType | None], None], usual: Callable[[Any], Any]
) -> Callable[[Any], None]:
    """Return a hook for exceptions that Python swallows: in destructors and callbacks of weak references.

    A signal that came just there would be lost; it is raised once more, when they have ended, or kills at
    once where no thread can be started to do so.
    """

    def hook(unraisable: Any) -> None:
        if not isinstance(unraisable.exc_value, Stopped):
            usual(unraisable)
            return
        number = unraisable.exc_value.number
        signal.signal(number, handle)
        again = Timer(_LATER, signal_main_thread, [number])  # wakes it, too
        again.daemon = True
        try:
            again.start()
        except RuntimeError:  # no thread can be started
            signal.signal(number, signal.SIG_DFL)
            signal_main_thread(number)

    return hook


def die_on_signals() -> None:
    """From now on SIGINT and SIGTERM kill at once: there is nothing left to clean up."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
