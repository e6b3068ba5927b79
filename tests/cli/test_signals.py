"""Signals where Python swallows exceptions."""

import subprocess
import sys

import pytest

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
