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
from dataclasses import asdict, dataclass, field, replace
from threading import Event, Thread
from typing import Any

from dmc_cli.app import conversion
from dmc_cli.app.conversion import ConvertResult
from dmc_cli.app.kept_volume import KeptVolume
from dmc_cli.app.output_folders import OutputFolders
from dmc_cli.errors import DeviceError, DmcError, RequirementError
from dmc_cli.measures import measure_quality, quality_kernels
from dmc_cli.mesh import mesh_of_file
from dmc_cli.progress import SILENT, Progress, SilentProgress
from dmc_cli.runtime import select_device
from dmc_cli.settings import ConvertSettings, MemoryShare
from dmc_cli.stop import check_stop, stopping_on
from dmc_cli.system import lacks_memory
from dmc_cli.volume import available_bytes

QUALITY = (
    *("shape_mean", "shape_min", "scaled_jacobian_min", "min_angle", "max_angle", "warpage_max"),
    "self_intersections",
)
"""Figures of a report's section `quality` that an outcome has."""

_BUG = 1
"""Status of an item that failed by an error of ours: the others go on all the same."""

_LONGEST_END = 5.0
"""Seconds that jobs have to end when the run is stopped; they rarely need one."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How one item ended.

    Attributes:
        input: Of the item.
        isovalue: A number once it is chosen; of a band and of an item that failed what was asked for.
        output: Of the item.
        status: The exit status that `dmc convert` would have had.
        error: What went wrong, or None.
        seconds: How long it took.
        vertices: Of the mesh, also of one that is not as required; None where there is none.
        quads: Likewise.
        triangles: Likewise.
        quality: The figures of `QUALITY`; intersections only where a report or a requirement counts them.
        requirements: The verdicts on what was required.
        report: The report's file, or None if none was written.
        warnings: What is told beside a mesh that was made.
        warning_codes: Their codes.
    """

    input: str
    isovalue: float | str | None
    output: str
    status: int
    error: str | None = None
    seconds: float = field(default=0.0, compare=False)
    vertices: int | None = None
    quads: int | None = None
    triangles: int | None = None
    quality: dict[str, float | None] | None = None
    requirements: tuple[dict[str, Any], ...] = ()
    report: str | None = None
    warnings: tuple[str, ...] = ()
    warning_codes: tuple[str, ...] = ()


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
        outcomes: One future an item.
        threads: Those that could be started.
    """

    def __init__(self, items: Sequence[ConvertSettings], jobs: int, folders: OutputFolders) -> None:
        self._folders = folders
        self.outcomes: list[Future[Outcome]] = [Future() for _ in items]
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
        kept = KeptVolume(self._items)
        with stopping_on(self._stop), suppress(IndexError):
            while not self._stop.is_set():
                item, outcome = self._waiting.popleft()
                try:
                    outcome.set_result(_convert_one(item, _Checking(), kept, self._folders))
                except BaseException as error:  # else the main thread would wait for ever
                    outcome.set_exception(error)


def convert_all(
    items: Sequence[ConvertSettings],
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
        shared = [replace(item, share=share) for item in items]
        with suppress(DmcError):  # each item tells
            # threads must not race to compile
            conversion.load_needed_kernels(shared, progress, quality_kernels())
        with OutputFolders() as folders, progress.stage(f"{len(items)} items"):
            if _convert_side_by_side(shared, tell, jobs, progress, whole, folders):
                return
    with OutputFolders() as folders:
        _convert_in_turn(items, tell, progress, whole, folders)


def _convert_in_turn(
    items: Sequence[ConvertSettings],
    tell: Callable[[Outcome], None],
    progress: Progress,
    whole: Callable[[], AbstractContextManager[None]],
    folders: OutputFolders,
) -> None:
    """Convert one item after the other; one that is done is told, whatever comes then."""
    kept = KeptVolume(items)
    for number, item in enumerate(items, 1):
        done: list[Outcome] = []
        try:
            with progress.stage(f"item {number} of {len(items)}"):
                done.append(_convert_one(item, progress, kept, folders))
        finally:
            with whole():
                for outcome in done:
                    tell(outcome)


def _convert_side_by_side(
    items: Sequence[ConvertSettings],
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
                tell(found)
            progress.advance(told / len(items))
    except BaseException:
        running.stop()
        for outcome in running.outcomes[told:]:
            if outcome.done() and outcome.exception() is None:
                tell(outcome.result())
        raise
    return True


def _convert_one(
    item: ConvertSettings, progress: Progress, kept: KeptVolume, folders: OutputFolders
) -> Outcome:
    """Convert an item; whatever is wrong with it becomes part of the outcome."""
    start = time.monotonic()
    outcome = _ended(item, progress, kept, folders)
    return replace(outcome, seconds=round(time.monotonic() - start, 3))


def _ended(item: ConvertSettings, progress: Progress, kept: KeptVolume, folders: OutputFolders) -> Outcome:
    """Return how an item ended."""
    facts: dict[str, Any] = {
        "input": item.input,
        "isovalue": item.surface.isovalue,
        "output": item.output.path,
    }
    try:
        folders.make(item)
        result = conversion.convert(item, progress, kept=kept)
        quality = _quality(result)
    except RequirementError as error:
        report: dict[str, Any] = error.report
        found = _found(item, report, report["quality"])
        return Outcome(**facts | found, status=error.exit_status, error=str(error))
    except DmcError as error:
        told = traceback.format_exc() if error.exit_status == _BUG else str(error)
        return Outcome(**facts, status=error.exit_status, error=told)
    except Exception as error:
        if lacks_memory(error):
            return Outcome(**facts, status=DeviceError.exit_status, error=f"the memory is used up: {error}")
        return Outcome(**facts, status=_BUG, error=traceback.format_exc())
    return Outcome(**facts | _found(item, result.report, quality), status=0)


def _quality(result: ConvertResult) -> dict[str, Any]:
    """Return the quality of a mesh; where no report has it, the figures that take hardly any time."""
    measured: dict[str, Any] | None = result.report["quality"]
    if measured is not None:
        return measured
    settings = result.report["settings"]
    mesh = mesh_of_file(result.mesh, select_device(settings["device"], settings["threads"]))
    return asdict(measure_quality(mesh)) | {"self_intersections": None}


def _found(item: ConvertSettings, report: dict[str, Any], quality: dict[str, Any]) -> dict[str, Any]:
    """Return what an outcome has of the report on a mesh and of its quality."""
    return {
        "isovalue": report["settings"]["isovalue"],
        **{key: report["mesh"][key] for key in ("vertices", "quads", "triangles")},
        "quality": {key: quality[key] for key in QUALITY},
        "requirements": tuple(report["requirements"]),
        "report": item.output.report,
        "warnings": tuple(report["warnings"]),
        "warning_codes": tuple(report["warning_codes"]),
    }
