"""Signals: soon, with their status and message, wherever they strike; a second one kills."""

import ctypes
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from dmc_cli.cli import signals

SWALLOWED = """
import os, signal, time, weakref
from dmc_cli.cli.signals import Stopped, raise_on_signals

class Thing:
    def __del__(self):
        if {in_destructor}:
            strike()

def strike(*_):
    os.kill(os.getpid(), signal.{name})
    time.sleep(0.05)  # the handler runs here, and what it raises goes no further than this callback

raise_on_signals()
thing = Thing()
if not {in_destructor}:
    reference = weakref.ref(thing, strike)
try:
    del thing
    time.sleep(20)
except Stopped as stopped:
    print(stopped.exit_status)
"""


@pytest.mark.parametrize("in_destructor", [False, True], ids=["weak-reference", "destructor"])
@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_in_a_callback_is_not_lost(name, status, in_destructor):
    script = SWALLOWED.format(name=name, in_destructor=in_destructor)
    if name == "SIGINT":  # a parent that ignores it, as `&` of a shell asks, hands that down
        script = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n" + script
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, encoding="utf-8", check=False, timeout=60
    )
    assert run.stdout.split() == [str(status)]
    assert run.stderr == ""


OUTSIDE = """
import os, signal, time
from dmc_cli import cli

def strike():
    os.kill(os.getpid(), signal.{name})
    time.sleep(20)

cli.dmc = strike  # before a command or after it, where the group's own handler is not there
cli.main()
"""


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_outside_of_a_command_has_its_message(name, status):
    script = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    script += OUTSIDE.format(name=name)
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, encoding="utf-8", check=False, timeout=60
    )
    assert run.returncode == status
    assert run.stderr.startswith("Error: ")
    assert run.stderr.endswith("no output was left incomplete\n")


IGNORED = """
import signal
from dmc_cli.cli.signals import die_on_signals, raise_on_signals

for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_IGN)
raise_on_signals()
print([signal.getsignal(number) is signal.SIG_IGN for number in (signal.SIGINT, signal.SIGTERM)])
die_on_signals()
print([signal.getsignal(number) is signal.SIG_IGN for number in (signal.SIGINT, signal.SIGTERM)])
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
raise_on_signals()
print([callable(signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM)])
die_on_signals()
print([signal.getsignal(number) is signal.SIG_DFL for number in (signal.SIGINT, signal.SIGTERM)])
"""


def test_signals_that_the_caller_ignores_stay_ignored():
    run = subprocess.run([sys.executable, "-c", IGNORED], capture_output=True, encoding="utf-8", check=True)
    assert run.stdout.splitlines() == ["[True, True]"] * 4


HELD = """
import os, signal, time
from dmc_cli.cli.signals import Stopped, raise_on_signals, signals_held

raise_on_signals()
try:
    with signals_held():
        os.kill(os.getpid(), signal.{name})
        time.sleep(0.05)
        print("whole")
    print("not reached")
except Stopped as stopped:
    print(stopped.exit_status)
with signals_held():
    print("and on")
"""


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_waits_for_the_end_of_what_must_be_whole(name, status):
    script = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    run = run_script(script + HELD.format(name=name))
    assert run.stdout.split() == ["whole", str(status), "and", "on"]
    assert run.stderr == ""


def run_script(script):
    words = [sys.executable, "-c", script]
    return subprocess.run(words, capture_output=True, encoding="utf-8", check=False, timeout=60)


NATIVE = """
import collections, functools, itertools, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from dmc_cli.cli.signals import raise_on_signals

raise_on_signals()
told = map(functools.partial(print, flush=True), ["ready"])
# never ends, and Python runs no handler before it has
collections.deque(itertools.chain(told, itertools.repeat(0)), maxlen=0)
"""


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "sysv_signal"), reason="not glibc"
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_a_second_signal_kills_in_the_middle_of_native_code(number):
    with subprocess.Popen([sys.executable, "-c", NATIVE], stdout=subprocess.PIPE) as run:
        try:
            assert run.stdout.readline() == b"ready\n"
            run.send_signal(number)
            time.sleep(0.3)
            assert run.poll() is None
            run.send_signal(number)
            assert run.wait(60) == -number
        finally:
            run.kill()


CLEANING_UP = """
import os, signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from dmc_cli.cli.signals import raise_on_signals

raise_on_signals()
try:
    os.kill(os.getpid(), signal.{first})
    time.sleep(20)
finally:
    os.kill(os.getpid(), signal.{second})
    time.sleep(20)
"""


@pytest.mark.parametrize("second", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("first", ["SIGINT", "SIGTERM"])
def test_a_second_signal_kills_whichever_it_is(first, second):
    run = run_script(CLEANING_UP.format(first=first, second=second))
    assert run.returncode == -signal.Signals[second]


AT_ONCE = 20
"""Seconds: far less than is left to do, far more than the end takes on a busy machine."""


@contextmanager
def running(folder, *words, **options):
    """A run of `dmc`, in which SIGINT is not ignored, and which is killed at last."""
    script = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    script += "from dmc_cli.cli import main; main()"
    with subprocess.Popen(
        [sys.executable, "-c", script, *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        **options,
    ) as run:
        try:
            yield run
        finally:
            run.kill()


def await_stage(run, name):
    """Read the messages of a run until it tells that a stage has begun."""
    for line in run.stderr:
        if line.startswith(name):
            break


def end_of(run, number):
    """Send a signal; exit status, output and messages of the run, which ends soon."""
    run.send_signal(number)
    start = time.monotonic()
    printed, messages = run.communicate(timeout=100)
    assert time.monotonic() - start < AT_ONCE
    assert "Traceback" not in messages
    return run.returncode, printed, messages


REMESH = ["-i", "0", "--remesh"]


@pytest.mark.parametrize("threads", ["1", "2"])
def test_a_signal_ends_a_remeshing_of_minutes(tmp_path, threads):
    words = ["convert", "synth:noise:48", "mesh.ply", *REMESH, "1000", "--threads", threads, "-v"]
    with running(tmp_path, *words) as run:
        await_stage(run, "simplifying")
        time.sleep(0.5)
        status, _, messages = end_of(run, signal.SIGINT)
    assert status == 130
    assert messages.endswith("interrupted; no output was left incomplete\n")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_a_batch_after_the_outcomes_of_what_is_done(tmp_path, number, status):
    words = ["batch", "synth:noise:80", "synth:torus:8", "synth:noise:81", *REMESH, "40", "--jobs", "2"]
    with running(tmp_path, *words) as run:
        while not (tmp_path / "synth_torus_8_0.ply").exists():
            assert run.poll() is None
            time.sleep(0.05)
        time.sleep(1)  # its outcome is there, too; it would be told after that of the first item
        found, printed, messages = end_of(run, number)
    assert found == status
    assert [json.loads(line)["input"] for line in printed.splitlines()] == ["synth:torus:8"]
    assert messages.endswith("no output was left incomplete\n")
    assert os.listdir(tmp_path) == ["synth_torus_8_0.ply"]


def test_a_signal_ends_a_run_that_waits_for_standard_input(tmp_path):
    words = ["convert", "-", "mesh.ply", "-i", "0", "-v"]
    with running(tmp_path, *words, stdin=subprocess.PIPE) as run:
        await_stage(run, "loading kernels")
        time.sleep(0.2)
        status, _, messages = end_of(run, signal.SIGTERM)
    assert status == 143
    assert messages.endswith("terminated; no output was left incomplete\n")


EARLY = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from dmc_cli.__main__ import main

class Struck:
    def find_spec(self, name, *_):
        if name == "dmc_cli.cli":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Struck())
main()
"""


def test_a_signal_while_the_command_line_is_imported_leaves_no_traceback():
    run = run_script(EARLY)
    assert run.returncode == -signal.SIGINT
    assert run.stderr == ""


def test_what_else_python_swallows_is_told_as_usual():
    told = []
    swallowed = SimpleNamespace(exc_value=ValueError("a destructor's"))
    signals._Handler().raising_again(told.append)(swallowed)
    assert told == [swallowed]
