"""Tell how far a long run is, and time it, without knowing who listens; imports nothing heavy.

The conversion and the readers report to a `Progress`. `SILENT` is the default of the Python API; the
command line hands in one that draws a bar on a terminal.
"""

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol


class Progress(Protocol):
    """Who listens to a run."""

    def stage(self, name: str) -> AbstractContextManager[None]:
        """Announce a stage for as long as the context is open; stages may nest."""
        ...

    def advance(self, fraction: float) -> None:
        """Tell how much of the innermost stage is done, from 0 to 1."""
        ...

    def note(self, text: str) -> None:
        """Tell a fact that is worth a line where the user asked for details."""
        ...


class SilentProgress:
    """Nobody listens."""

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Do nothing but run the body."""
        yield

    def advance(self, fraction: float) -> None:
        """Do nothing."""

    def note(self, text: str) -> None:
        """Do nothing."""


SILENT = SilentProgress()


class Stopwatch:
    """Times the stages of a run and reports their names to whoever listens."""

    def __init__(self, progress: Progress) -> None:
        self.milliseconds: dict[str, float] = {}
        self.progress = progress
        self._start = time.perf_counter()

    @contextmanager
    def stage(self, name: str, shown: str) -> Iterator[None]:
        """Time a stage; `shown` is its name for people."""
        start = time.perf_counter()
        with self.progress.stage(shown):
            yield
        self.milliseconds[name] = self.milliseconds.get(name, 0.0) + 1e3 * (time.perf_counter() - start)

    def total(self) -> None:
        """Note the time since the start."""
        self.milliseconds["total"] = 1e3 * (time.perf_counter() - self._start)
