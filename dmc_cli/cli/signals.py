"""Signals as exceptions, so that every `with` on the way out cleans up."""

import signal
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopped(BaseException):
    """SIGINT or SIGTERM arrived; no handler of ordinary errors may swallow it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
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


def die_on_signals() -> None:
    """From now on SIGINT and SIGTERM kill at once: there is nothing left to clean up."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
