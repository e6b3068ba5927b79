"""Show on standard error how far a run is: a bar on a terminal, lines with -v, else nothing."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import click

from dmc_cli.cli.terminal import echo_lines, unescaped
from dmc_cli.printable import printable
from dmc_cli.progress import SILENT, Progress

if TYPE_CHECKING:
    import rich.progress


@contextmanager
def shown_progress(*, quiet: bool, verbose: int) -> Iterator[Progress]:
    """Open the progress that fits: a bar needs a terminal, and --quiet silences it."""
    if quiet:
        yield SILENT
    elif sys.stderr.isatty() and (bar := _started_bar()) is not None:
        with bar:
            yield BarProgress(bar, verbose)
    else:
        yield LineProgress() if verbose else SILENT


class LineProgress:
    """One line per stage with its time, and the notes; for logs."""

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Tell the time when the stage is over."""
        start = time.perf_counter()
        yield
        self.note(f"{name}: {time.perf_counter() - start:.2f} s")

    def advance(self, fraction: float) -> None:
        """Do nothing: lines do not move."""

    def note(self, text: str) -> None:
        """Print a line."""
        echo_lines([text], err=True)


class BarProgress:
    """A bar for each open stage, gone when the run is over; with -v one line per stage stays."""

    def __init__(self, bar: "rich.progress.Progress", verbose: int) -> None:
        self._bar = bar
        self._verbose = verbose
        self._stages: list[rich.progress.TaskID] = []

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Show the stage's bar, pulsing until `advance` tells how far it is."""
        start = time.perf_counter()
        task = self._bar.add_task(printable(name, keep=""), total=None)
        self._stages.append(task)
        try:
            yield
        finally:
            self._stages.remove(task)
            self._bar.remove_task(task)
        self.note(f"{name}: {time.perf_counter() - start:.2f} s")

    def advance(self, fraction: float) -> None:
        """Move the bar of the innermost stage."""
        if self._stages:
            self._bar.update(self._stages[-1], total=1.0, completed=fraction)

    def note(self, text: str) -> None:
        """Print a line above the bars."""
        if self._verbose:
            self._bar.console.print(printable(text, keep=""), markup=False, highlight=False)

    @contextmanager
    def hidden(self) -> Iterator[None]:
        """Take the bars off the terminal for as long as something else is printed there."""
        self._bar.stop()
        try:
            yield
        finally:
            with suppress(RuntimeError):  # no thread to draw them
                self._bar.start()


def echo_data(text: str, progress: Progress) -> None:
    """Print a line on standard output, with the bars out of its way where both are on the terminal."""
    if isinstance(progress, BarProgress) and sys.stdout.isatty():
        with progress.hidden():
            click.echo(text)
    else:
        click.echo(text)


def _started_bar() -> "rich.progress.Progress | None":
    """Make a bar and start it, or return None where there is no thread to draw it."""
    bar = _opened_bar()
    try:
        bar.start()
    except RuntimeError:
        with suppress(RuntimeError):  # of a thread that never ran
            bar.stop()
        return None
    return bar


def _opened_bar() -> "rich.progress.Progress":
    """Make a bar on standard error; rich honours NO_COLOR and TERM=dumb."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    return Progress(
        TextColumn("{task.description:<24}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        console=Console(file=unescaped(sys.stderr)),
        transient=True,
        # rich would put streams of its own there, which escape nothing
        redirect_stdout=False,
        redirect_stderr=False,
    )
