"""Run many conversions: a failure does not stop the others, and folders of outputs are made.

Items are independent. With several jobs they run in threads: kernels and decompression release the
interpreter's lock, so one item is read and another written while a third computes. Outcomes come in the
order of the items, whatever the order in which they finish. Each job has an equal share of the memory: what
the others will take cannot be told from what is free now. When the run is stopped, jobs at work end at their
next check, within a second mostly.
"""

import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import replace
from threading import Event, Thread
from typing import Any

from dmc_cli.app import conversion
from dmc_cli.app.kept_volume import KeptVolume
from dmc_cli.app.label_conversion import convert_labels, load_label_kernels
from dmc_cli.app.outcomes import Outcome, found_of, found_of_labels, quality_of
from dmc_cli.app.output_folders import OutputFolders
from dmc_cli.errors import DeviceError, DmcError, RequirementError
from dmc_cli.measures import quality_kernels
from dmc_cli.progress import SILENT, Progress, SilentProgress
from dmc_cli.settings import ConvertSettings, LabelSettings, MemoryShare
from dmc_cli.stop import check_stop, stopping_on
from dmc_cli.system import lacks_memory
from dmc_cli.volume import available_bytes

Item = ConvertSettings | LabelSettings
"""What becomes a mesh at an isovalue, or a shell of each label or a mesh that they share."""

_BUG = 1
"""Status of an item that failed by an error of ours: the others go on all the same."""

_LONGEST_END = 5.0
"""Seconds that jobs have to end when the run is stopped; they rarely need one."""


class _Checking(SilentProgress):
    """Ends a job at its next stage or step when it was asked to stop."""

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Check as a stage begins."""
        check_stop()
        yield

    def advance(self, fraction: float) -> None:
        """Check at each step."""
        check_stop()


class _Jobs:
    """Threads that convert items side by side, as many as the system allows up to a number.

    Attributes:
        outcomes: One future an item, of its outcomes.
        threads: Those that could be started.
    """

    def __init__(self, items: Sequence[Item], jobs: int, folders: OutputFolders) -> None:
        self._folders = folders
        self.outcomes: list[Future[list[Outcome]]] = [Future() for _ in items]
        self._waiting = deque(zip(items, self.outcomes, strict=True))
        self._items = items
        self._stop = Event()
        self.threads: list[Thread] = []
        with suppress(RuntimeError):  # no more can be started
            for number in range(jobs):
                thread = Thread(target=self._work, name=f"dmc-job-{number}", daemon=True)
                thread.start()
                self.threads.append(thread)

    def stop(self) -> None:
        """Ask the jobs to end at their next check, and wait for them for a limited time."""
        self._stop.set()
        end = time.monotonic() + _LONGEST_END
        for thread in self.threads:
            thread.join(max(end - time.monotonic(), 0.0))

    def _work(self) -> None:
        kept = KeptVolume(_at_isovalues(self._items))
        with stopping_on(self._stop), suppress(IndexError):
            while not self._stop.is_set():
                item, outcome = self._waiting.popleft()
                try:
                    outcome.set_result(_convert_one(item, _Checking(), kept, self._folders))
                except BaseException as error:  # else the main thread would wait for ever
                    outcome.set_exception(error)


def convert_all(
    items: Sequence[Item],
    tell: Callable[[Outcome], None],
    jobs: int = 1,
    progress: Progress = SILENT,
    whole: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> None:
    """Convert each item and report how it ended, in the order of the items.

    When an exception stops the run, as a signal does, the outcomes of the items that are done are told first.

    Args:
        items: What to convert; no two share an output.
        tell: Called with each outcome, by the calling thread.
        jobs: Items at work at the same time; they share the memory.
        progress: Who is told the stages; of several jobs only how many items are done.
        whole: A context in which no signal raises an exception, for what must not be left half done.
    """
    jobs = min(jobs, len(items))
    if jobs > 1:
        share = MemoryShare(jobs=jobs, free=available_bytes())
        shared: list[Item] = [replace(item, share=share) for item in items]
        with suppress(DmcError):  # each item tells
            # threads must not race to compile
            conversion.load_needed_kernels(_at_isovalues(shared), progress, quality_kernels())
            load_label_kernels([item for item in shared if isinstance(item, LabelSettings)], progress)
        with OutputFolders() as folders, progress.stage(f"{len(items)} items"):
            if _convert_side_by_side(shared, tell, jobs, progress, whole, folders):
                return
    with OutputFolders() as folders:
        _convert_in_turn(items, tell, progress, whole, folders)


def _convert_in_turn(
    items: Sequence[Item],
    tell: Callable[[Outcome], None],
    progress: Progress,
    whole: Callable[[], AbstractContextManager[None]],
    folders: OutputFolders,
) -> None:
    """Convert one item after the other; one that is done is told, whatever comes then."""
    kept = KeptVolume(_at_isovalues(items))
    for number, item in enumerate(items, 1):
        done: list[Outcome] = []
        try:
            with progress.stage(f"item {number} of {len(items)}"):
                done += _convert_one(item, progress, kept, folders)
        finally:
            with whole():
                for outcome in done:
                    tell(outcome)


def _convert_side_by_side(
    items: Sequence[Item],
    tell: Callable[[Outcome], None],
    jobs: int,
    progress: Progress,
    whole: Callable[[], AbstractContextManager[None]],
    folders: OutputFolders,
) -> bool:
    """Convert the items in threads; return whether any could be started."""
    running, told = _Jobs(items, jobs, folders), 0
    if not running.threads:
        return False
    try:
        for outcome in running.outcomes:
            found = outcome.result()
            with whole():
                told += 1
                for one in found:
                    tell(one)
            progress.advance(told / len(items))
    except BaseException:
        running.stop()
        for outcome in running.outcomes[told:]:
            if outcome.done() and outcome.exception() is None:
                for one in outcome.result():
                    tell(one)
        raise
    return True


def _at_isovalues(items: Sequence[Item]) -> list[ConvertSettings]:
    """Return the items that are not of labels."""
    return [item for item in items if isinstance(item, ConvertSettings)]


def _convert_one(item: Item, progress: Progress, kept: KeptVolume, folders: OutputFolders) -> list[Outcome]:
    """Convert an item; whatever is wrong with it becomes part of its outcomes, of labels several."""
    start = time.monotonic()
    outcomes = _ended(item, progress, kept, folders)
    seconds = (time.monotonic() - start) / len(outcomes)
    return [replace(outcome, seconds=round(seconds, 3)) for outcome in outcomes]


def _ended(item: Item, progress: Progress, kept: KeptVolume, folders: OutputFolders) -> list[Outcome]:
    """Return how an item ended."""
    isovalue = None if isinstance(item, LabelSettings) else item.surface.isovalue
    facts: dict[str, Any] = {"input": item.input, "isovalue": isovalue, "output": item.output.path}
    try:
        folders.make(item)
        if isinstance(item, LabelSettings):
            made = convert_labels(item, progress)
            found = found_of_labels(item, made.report, made.meshes)
        else:
            result = conversion.convert(item, progress, kept=kept)
            found = [found_of(item, result.report, quality_of(result))]
        return [Outcome(**facts | one, status=0) for one in found]
    except RequirementError as error:
        unmet: dict[str, Any] = {"status": error.exit_status, "error": str(error)}
        report: dict[str, Any] = error.report
        if isinstance(item, LabelSettings):
            found = found_of_labels(item, report, {})
        else:
            found = [found_of(item, report, report["quality"])]
        return [Outcome(**facts | one | unmet) for one in found]
    except DmcError as error:
        told = traceback.format_exc() if error.exit_status == _BUG else str(error)
        return [Outcome(**facts, status=error.exit_status, error=told)]
    except Exception as error:
        if lacks_memory(error):
            told = f"the memory is used up: {error}"
            return [Outcome(**facts, status=DeviceError.exit_status, error=told)]
        return [Outcome(**facts, status=_BUG, error=traceback.format_exc())]
