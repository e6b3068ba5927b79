"""Jobs of a batch as a Python program sees them: few threads or none, and an exception in the middle."""

import threading
import time
from contextlib import contextmanager

import pytest

from dmc_cli.app import batch
from dmc_cli.app.batch import Outcome, convert_all
from dmc_cli.progress import SilentProgress
from dmc_cli.settings import ConvertSettings, OutputSettings, SurfaceSettings
from dmc_cli.stop import StopRequested, check_stop

SOON = 20
"""Seconds: far less than what is stopped would take."""


def items(count):
    return [
        ConvertSettings(
            input=f"synth:torus:{8 + n}",
            surface=SurfaceSettings(isovalue=0),
            output=OutputSettings(path=f"{n}.ply"),
        )
        for n in range(count)
    ]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcomes_of(count, jobs):
    told = []
    convert_all(items(count), told.append, jobs)
    assert [outcome.output for outcome in told] == [f"{n}.ply" for n in range(count)]
    assert all(outcome.status == 0 for outcome in told)
    return told


@pytest.mark.parametrize("allowed", [0, 1])
def test_where_few_threads_can_be_made_those_do_the_work(folder, monkeypatch, allowed):
    expected = outcomes_of(3, 1)
    for path in folder.glob("*.ply"):
        path.unlink()
    started = []

    def start(thread):
        if not thread.name.startswith("dmc-job") or len(started) == allowed:
            raise RuntimeError("can't start new thread")
        started.append(thread)
        begin(thread)

    begin = threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", start)
    assert outcomes_of(3, 3) == expected
    assert len(started) == allowed


class InterruptError(BaseException):
    pass


def convert_slowly(item, progress, _kept, _folders):
    """The first two items are done at once; the others take minutes, and look whether they should stop."""
    if item.output.path not in ("0.ply", "1.ply"):
        for _ in range(10_000):
            time.sleep(0.02)
            progress.advance(0.5)
    return [Outcome(input=item.input, isovalue=0.0, output=item.output.path, status=0)]


def test_an_exception_stops_the_jobs_and_what_is_done_is_told_once(folder, monkeypatch):
    jobs, told = [], []

    class SeenJobs(batch._Jobs):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            jobs.append(self)

    def tell(outcome):
        told.append(outcome.output)
        while not jobs[0].outcomes[1].done():
            time.sleep(0.01)
        if outcome.output == "0.ply":
            raise InterruptError

    monkeypatch.setattr(batch, "_Jobs", SeenJobs)
    monkeypatch.setattr(batch, "_convert_one", convert_slowly)
    start = time.monotonic()
    with pytest.raises(InterruptError):
        convert_all(items(5), tell, 2)
    assert time.monotonic() - start < SOON
    assert told == ["0.ply", "1.ply"]
    assert not any(thread.is_alive() for thread in jobs[0].threads)
    ended = [outcome.exception() for outcome in jobs[0].outcomes[2:] if outcome.done()]
    assert ended and all(isinstance(error, StopRequested) for error in ended)


def test_an_item_that_is_done_is_told_whatever_comes_before_its_line(folder):
    class Interrupted(SilentProgress):
        @contextmanager
        def stage(self, name):
            yield
            if name == "item 2 of 3":
                raise InterruptError

    told = []
    with pytest.raises(InterruptError):
        convert_all(items(3), told.append, 1, Interrupted())
    assert [outcome.output for outcome in told] == ["0.ply", "1.ply"]
    assert sorted(path.name for path in folder.glob("*.ply")) == ["0.ply", "1.ply"]


def test_an_error_that_ends_a_thread_ends_the_run(folder, monkeypatch):
    def fail(item, progress, _kept, _folders):
        raise SystemExit("told")

    monkeypatch.setattr(batch, "_convert_one", fail)
    with pytest.raises(SystemExit, match="told"):
        convert_all(items(3), pytest.fail, 2)


def test_jobs_look_at_each_stage_whether_to_stop():
    event = threading.Event()
    progress = batch._Checking()
    with batch.stopping_on(event):
        with progress.stage("reading"):
            progress.advance(0.5)
        event.set()
        with pytest.raises(StopRequested), progress.stage("reading"):
            pytest.fail("the stage began")
        with pytest.raises(StopRequested):
            progress.advance(0.6)
    check_stop()
