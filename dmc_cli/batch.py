"""Many conversions in one run: a failure does not stop the others.

Items are independent. With several jobs they run in threads: kernels and decompression release the
interpreter's lock, so one item is read and another written while a third computes. Outcomes come in the
order of the items, whatever the order in which they finish. Each job has an equal share of the memory: what
the others will take cannot be told from what is free now.
"""

import traceback
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from dmc_cli import pipeline
from dmc_cli.errors import DeviceError, DmcError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ConvertSettings, MemoryShare
from dmc_cli.threads import each_in_threads
from dmc_cli.volume.allocation import available_bytes

_BUG = 1
"""Status of an item that failed by an error of ours: the others go on all the same."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How one item ended; `status` is the exit status that `dmc convert` would have had."""

    input: str
    isovalue: float
    output: str
    status: int
    error: str | None = None
    vertices: int | None = None
    quads: int | None = None
    warnings: tuple[str, ...] = ()


def convert_all(
    items: Sequence[ConvertSettings], jobs: int = 1, progress: Progress = SILENT
) -> Iterator[Outcome]:
    """Convert each item and yield how it ended, in the order of the items.

    Args:
        items: What to convert; no two share an output.
        jobs: Items at work at the same time; they share the memory.
        progress: Who is told the stages; of several jobs only how many items are done.
    """
    jobs = min(jobs, len(items))
    if jobs <= 1:
        for number, item in enumerate(items, 1):
            with progress.stage(f"item {number} of {len(items)}"):
                outcome = _convert_one(item, progress)
            yield outcome
        return
    share = MemoryShare(jobs=jobs, free=available_bytes())
    items = [replace(item, share=share) for item in items]
    pipeline.load_needed_kernels(items, progress)  # threads must not race to compile
    with progress.stage(f"{len(items)} items"):
        outcomes = each_in_threads(partial(_convert_one, progress=SILENT), items, jobs, "dmc-job")
        with closing(outcomes):
            for done, outcome in enumerate(outcomes, 1):
                yield outcome
                progress.advance(done / len(items))


def _convert_one(item: ConvertSettings, progress: Progress) -> Outcome:
    """Convert an item; whatever is wrong with it becomes part of the outcome."""
    facts: dict[str, Any] = {
        "input": item.input,
        "isovalue": item.surface.isovalue,
        "output": item.output.path,
    }
    try:
        result = pipeline.convert(item, progress)
    except DmcError as error:
        told = traceback.format_exc() if error.exit_status == _BUG else str(error)
        return Outcome(**facts, status=error.exit_status, error=told)
    except MemoryError as error:
        return Outcome(**facts, status=DeviceError.exit_status, error=f"the memory is used up: {error}")
    except Exception:
        return Outcome(**facts, status=_BUG, error=traceback.format_exc())
    return Outcome(
        **facts,
        status=0,
        vertices=len(result.mesh.vertices),
        quads=len(result.mesh.quads),
        warnings=tuple(result.report["warnings"]),
    )
