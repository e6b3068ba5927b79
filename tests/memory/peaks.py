"""Measure the memory that a convert takes, stage by stage, beside what was forecast.

    python -m tests.memory.peaks synth:iwp:256 out.ply -i 0 [OPTIONS OF CONVERT]

The numbers are Linux's own: the high-water mark of the resident memory, set back before each stage through
`/proc/self/clear_refs`. Pages of a mapped file, which the system takes back when it needs them, are left out:
during a stage they grow, or go when the file is let go, so as many as there are at its begin or its end count
for its peak. What was resident before, Python, Warp and its kernels, is left out as well. Every convert runs
in a process forked from this one, in which Warp is loaded and no thread has begun.
"""

import contextlib
import io
import json
import os
import pkgutil
import sys
import traceback
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

STATUS = Path("/proc/self/status")
CLEAR = Path("/proc/self/clear_refs")


def resident() -> dict[str, int]:
    """Return the bytes of VmHWM, RssAnon, RssFile, ... of this process."""
    lines = (line.split() for line in STATUS.read_text().splitlines())
    return {words[0][:-1]: 1024 * int(words[1]) for words in lines if len(words) == 3 and words[2] == "kB"}


def can_measure() -> bool:
    """Return whether the system tells peaks and lets them be set back."""
    try:
        CLEAR.write_text("5")
    except OSError:
        return False
    return "VmHWM" in resident() and "RssFile" in resident()


@dataclass
class Peaks:
    """Peaks in bytes by stage, above what was resident before; and the forecasts, in their order."""

    base: int = 0
    stages: dict[str, int] = field(default_factory=dict)
    forecasts: list[dict[str, int]] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    status: int = 0

    @property
    def peak(self) -> int:
        return max(self.stages.values(), default=0)


class Meter:
    """Takes the peak since it was asked last."""

    def __init__(self) -> None:
        self.before = resident()
        CLEAR.write_text("5")
        self.peaks, self.files = Peaks(self.before["RssAnon"]), 0  # bytes of files at the stage's begin

    def take(self, name: str) -> None:
        now = resident()
        files = now["RssFile"] - self.before["RssFile"]
        peak = now["VmHWM"] - self.before["VmRSS"] - max(self.files, files)
        self.peaks.stages[name] = max(peak, self.peaks.stages.get(name, 0))
        self.files = files
        CLEAR.write_text("5")


def measured(words: list[str]) -> Peaks:
    """Run `dmc` with these words in this process, which is not of much use afterwards."""
    from dmc_cli import progress
    from dmc_cli.app import memory_budget as memory
    from dmc_cli.cli import dmc

    meter = Meter()
    stage = progress.Stopwatch.stage

    @contextlib.contextmanager
    def watched(self, name, shown):
        meter.take("between")
        with stage(self, name, shown):
            yield
        meter.take(name)

    def noted(forecast, *rest, **named):
        meter.peaks.forecasts.append(forecast if isinstance(forecast, dict) else {"all": forecast})
        return hold(forecast, *rest, **named)

    hold = memory.reserve
    memory.reserve = noted
    progress.Stopwatch.stage = watched
    try:
        dmc(words, standalone_mode=False)
    except SystemExit as end:
        meter.peaks.status = int(end.code or 0)
    meter.take("end")
    return meter.peaks


def in_a_process(words: list[str]) -> Peaks:
    """Run `dmc` in a process of its own, forked from this one."""
    sys.stdout.flush()
    receive, send = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(receive)
            told = io.StringIO()
            with contextlib.redirect_stderr(told), contextlib.redirect_stdout(told):
                peaks = measured(words)
            os.write(send, json.dumps(vars(peaks) | {"told": told.getvalue()}).encode())
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(send)
    with os.fdopen(receive, "rb") as stream:
        answer = stream.read()
    os.waitpid(child, 0)
    if not answer:
        raise RuntimeError(f"dmc {' '.join(words)} failed")
    told = json.loads(answer)
    if told["status"]:
        raise RuntimeError(told["told"])
    del told["told"]
    return Peaks(**told)


def load() -> None:
    """Load all kernels and modules, so that a convert takes memory for its arrays alone."""
    import dmc_cli
    from dmc_cli.app import conversion
    from dmc_cli.cli.light_nibabel import import_nibabel_lightly
    from dmc_cli.runtime.device import load_kernels, select_device

    load_kernels(select_device("cpu"), conversion.every_kernel())
    import_nibabel_lightly()
    for found in pkgutil.walk_packages(dmc_cli.__path__, "dmc_cli."):
        if not found.name.endswith("__main__"):
            import_module(found.name)
    import_module("nibabel.nifti1")


def serve() -> None:
    """Answer each line on standard input, the words of a convert in JSON, with a line of its peaks."""
    for line in sys.stdin:
        try:
            answer = vars(in_a_process(json.loads(line)))
        except RuntimeError as error:
            answer = {"error": str(error)}
        print(json.dumps(answer), flush=True)


def main() -> None:
    load()
    if sys.argv[1:] == ["--serve"]:
        serve()
        return
    peaks = in_a_process(["convert", *sys.argv[1:], "--force"])
    mib = 2**20
    forecasts = peaks.forecasts[-1]
    print(f"base {peaks.base / mib:.0f} MiB")
    for name, peak in peaks.stages.items():
        print(f"{name:15} {peak / mib:8.1f} MiB, forecast {forecasts.get(name, 0) / mib:8.1f}")
    for forecast in peaks.forecasts:
        most = max(forecast, key=forecast.get)
        share = forecast[most] / max(peaks.peak, 1)
        print(f"forecast {forecast[most] / mib:.1f} MiB ({most}): {share:.2f} of the peak")


if __name__ == "__main__":
    main()
