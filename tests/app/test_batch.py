"""Many conversions in Python: each outcome in its order, whatever happens to an item."""

import threading
import time
from dataclasses import replace

import pytest

from dmc_cli.app import batch, conversion
from dmc_cli.app.batch import Outcome, convert_all
from dmc_cli.errors import DamagedVolumeError, WriteError
from dmc_cli.progress import SILENT, SilentProgress
from dmc_cli.settings import ConvertSettings, MemoryShare, OutputSettings, SurfaceSettings


class Listener(SilentProgress):
    """Notes the stages and how far they were."""

    def __init__(self):
        self.stages, self.fractions = [], []

    def stage(self, name):
        self.stages.append(name)
        return super().stage(name)

    def advance(self, fraction):
        self.fractions.append(fraction)


def items(*sources):
    return [
        ConvertSettings(
            input=source,
            surface=SurfaceSettings(isovalue=number / 2),
            output=OutputSettings(path=f"{number}.ply"),
        )
        for number, source in enumerate(sources)
    ]


def outcomes_of(planned, jobs=1, progress=SILENT):
    told = []
    convert_all(planned, told.append, jobs, progress)
    return told


@pytest.fixture
def seen(monkeypatch):
    """Let conversions raise what their input names, and note the settings that they had."""
    found = []
    errors = {
        "damaged": DamagedVolumeError("cut short"),
        "large": MemoryError("9 TiB"),
        "bug": ZeroDivisionError("oops"),
    }

    def convert(item, progress, **_):
        found.append(item)
        if item.input in errors:
            raise errors[item.input]
        return original(item, progress)

    original = conversion.convert
    monkeypatch.setattr(conversion, "convert", convert)
    return found


@pytest.mark.parametrize("jobs", [1, 2, 9])
def test_outcomes_come_in_the_order_of_the_items(seen, tmp_path, monkeypatch, jobs):
    monkeypatch.chdir(tmp_path)
    planned = items("damaged", "synth:torus:12", "large", "bug")
    first, second, third, fourth = outcomes_of(planned, jobs)
    assert first == Outcome(input="damaged", isovalue=0.0, output="0.ply", status=3, error="cut short")
    assert (second.status, second.error, second.isovalue, second.output) == (5, second.error, 0.5, "1.ply")
    assert third == Outcome(
        input="large", isovalue=1.0, output="2.ply", status=7, error="the memory is used up: 9 TiB"
    )
    assert fourth.status == 1
    assert fourth.error.startswith("Traceback")
    assert "ZeroDivisionError: oops" in fourth.error
    assert [item.input for item in sorted(seen, key=lambda item: item.output.path)] == [
        item.input for item in planned
    ]
    shares = {item.share for item in seen}
    assert shares == {MemoryShare()} if jobs == 1 else {share.jobs for share in shares} == {min(jobs, 4)}


def test_an_outcome_counts_and_warns(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    item = ConvertSettings(
        input="synth:torus:12",
        surface=SurfaceSettings(isovalue=0.0),
        output=OutputSettings(path="a.off", normals=True),
    )
    (found,) = outcomes_of([item])
    assert (found.status, found.error, found.warnings) == (
        0,
        None,
        ("OFF files hold no normals: they were left out",),
    )
    assert found.vertices == found.quads > 100  # a torus
    assert outcomes_of([]) == []


def test_one_item_is_alone_whatever_the_jobs(seen, monkeypatch):
    monkeypatch.setattr(batch, "Thread", lambda **_: pytest.fail("threads were started"))
    assert [found.status for found in outcomes_of(items("bug"), 4)] == [1]


@pytest.mark.parametrize("jobs", [1, 2])
def test_progress_tells_how_many_are_done(seen, jobs):
    listener = Listener()
    assert len(outcomes_of(items("bug", "damaged", "large", "bug"), jobs, listener)) == 4
    if jobs == 1:
        assert listener.stages == [f"item {number} of 4" for number in (1, 2, 3, 4)]
    else:
        assert "4 items" in listener.stages
        assert listener.fractions == [0.25, 0.5, 0.75, 1.0]


def test_jobs_work_at_the_same_time_and_no_more_of_them(monkeypatch):
    together = threading.Barrier(2, timeout=60)
    at_work, most = [], []

    def convert(item, _progress, **_):
        at_work.append(item)
        most.append(len(at_work))
        together.wait()
        at_work.remove(item)
        raise DamagedVolumeError("done")

    monkeypatch.setattr(conversion, "convert", convert)
    assert [found.status for found in outcomes_of(items(*"abcd"), 2)] == [3] * 4
    assert max(most) == 2


def test_who_stops_listening_stops_the_items_that_wait(monkeypatch):
    begun, go_on = [], threading.Event()

    def convert(item, _progress, **_):
        begun.append(item)
        if item.output.path != "0.ply":  # whichever begins first: that one alone is done, and told
            go_on.wait(60)
        raise DamagedVolumeError("done")

    monkeypatch.setattr(conversion, "convert", convert)

    def listen(_outcome):
        raise InterruptedError

    def stop_and_go_on(jobs):
        jobs._stop.set()
        go_on.set()
        stop(jobs)

    stop = batch._Jobs.stop
    monkeypatch.setattr(batch._Jobs, "stop", stop_and_go_on)
    with pytest.raises(InterruptedError):
        convert_all(items(*"abcdefgh"), listen, 2)
    assert len(begun) <= 3


def test_kernels_are_loaded_before_jobs_begin(seen, monkeypatch):
    order = []
    monkeypatch.setattr(conversion, "load_needed_kernels", lambda loaded, *_: order.append(len(loaded)))
    outcomes_of(items("bug", "bug"), 2)
    outcomes_of(items("bug", "bug"), 1)
    assert order == [2]


def test_kernels_that_cannot_be_loaded_fail_every_item(seen, monkeypatch):
    def refuse(*_):
        raise WriteError("the kernel cache cannot be used")

    monkeypatch.setattr(conversion, "load_needed_kernels", refuse)
    monkeypatch.setattr(conversion, "convert", lambda *_, **__: refuse())
    assert [found.status for found in outcomes_of(items("a", "b"), 2)] == [9, 9]


def test_a_hundred_items_need_no_more_threads_than_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (item,) = items("synth:torus:8")
    planned = [replace(item, output=OutputSettings(path=f"{number}.ply")) for number in range(100)]
    assert {found.status for found in outcomes_of(planned[:4], 2)} == {0}
    before = threading.active_count()
    assert {found.status for found in outcomes_of(planned[4:], 2)} == {0}
    deadline = time.monotonic() + 30
    while threading.active_count() > before:  # jobs end soon after their last outcome
        assert time.monotonic() < deadline
        time.sleep(0.01)
