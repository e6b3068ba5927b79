"""A convert runs without whatever one operating system has and another lacks."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from dmc_cli import system

WITHOUT = """
import os, signal, sys
import numpy, rich.progress, warp  # which ask the system's name first

for module in {modules}:
    sys.modules[module] = None  # an import of it fails
for name in {names}:
    owner, _, attribute = name.rpartition(".")
    vars(sys.modules[owner]).pop(attribute, None)
from dmc_cli.cli import main
main()
"""

WINDOWS = {
    "modules": ["fcntl", "grp", "pwd", "resource", "termios", "tty"],
    "names": [
        *(f"os.{name}" for name in ("O_NOFOLLOW", "fchmod", "fork", "geteuid", "getloadavg", "getuid")),
        *(f"os.{name}" for name in ("mkfifo", "nice", "pathconf", "pread", "pwrite", "readv")),
        *(f"os.{name}" for name in ("register_at_fork", "sched_getaffinity", "sched_yield", "setsid")),
        *(f"os.{name}" for name in ("statvfs", "sysconf", "uname", "wait4", "waitid")),
        *(f"signal.{name}" for name in ("SIGALRM", "SIGBUS", "SIGHUP", "SIGPIPE", "SIGUSR1", "alarm")),
        *(f"signal.{name}" for name in ("pthread_kill", "pthread_sigmask", "setitimer", "siginterrupt")),
    ],
}
MACOS = {"modules": [], "names": ["os.sched_getaffinity", "os.sched_setaffinity"]}


def run_without(lacking, *words, folder):
    script = WITHOUT.format(**lacking)
    command = [sys.executable, "-c", script, *words]
    return subprocess.run(
        command, cwd=folder, capture_output=True, encoding="utf-8", timeout=200, check=False
    )


@pytest.mark.parametrize("lacking", [MACOS, WINDOWS], ids=["macos", "windows"])
def test_a_convert_runs_without_what_other_systems_lack(tmp_path, lacking):
    words = ["convert", "synth:torus:24", "mesh.ply", "-i", "0", "--report", "report.json", "--check"]
    result = run_without(lacking, *words, folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert sorted(os.listdir(tmp_path)) == ["mesh.ply", "report.json"]
    report = json.loads((tmp_path / "report.json").read_text())
    assert (report["memory"]["peak_rss_bytes"] is None) == ("resource" in lacking["modules"])
    assert report["settings"]["threads"] == os.cpu_count()
    again = run_without(lacking, *words, folder=tmp_path)
    assert again.returncode == 9
    assert "exists already" in again.stderr


def test_a_dicom_series_is_read_and_described_without_what_windows_lacks(tmp_path, sample_data):
    result = run_without(WINDOWS, "info", str(sample_data / "dicom" / "head_ct"), folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "dicom" in result.stdout


def test_doctor_runs_without_what_windows_lacks(tmp_path):
    result = run_without(WINDOWS, "doctor", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert f"{os.cpu_count()} core(s)" in result.stdout


def test_the_cores_are_those_that_this_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {3, 5, 8}, raising=False)
    assert system.usable_cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    assert system.usable_cores() == 7
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert system.usable_cores() == 1


@pytest.mark.parametrize("can_wake", [True, False])
def test_a_signal_reaches_the_main_thread_with_its_number(monkeypatch, can_wake):
    if not can_wake:
        monkeypatch.delattr(signal, "pthread_kill")
    got = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: got.append(number))
    try:
        sender = threading.Thread(target=system.signal_main_thread, args=[signal.SIGTERM])
        sender.start()
        sender.join()
        deadline = time.monotonic() + 10
        while not got and time.monotonic() < deadline:
            pass
    finally:
        signal.signal(signal.SIGTERM, before)
    assert got == [signal.SIGTERM]


@pytest.mark.parametrize(
    ("limit", "is_enough"), [(-1, True), (1 << 27, False), (1 << 28, True), (192 << 20, True)]
)
def test_a_limit_that_nothing_can_run_under_is_told(monkeypatch, limit, is_enough):
    monkeypatch.setattr(system.resource, "getrlimit", lambda what: (limit, -1))
    if is_enough:
        system.check_address_space()
    else:
        with pytest.raises(MemoryError, match=rf"ulimit -v.* is {limit >> 20} MiB"):
            system.check_address_space()


def test_memory_is_in_bytes_and_none_where_nobody_tells(monkeypatch):
    assert system.peak_memory() > 10 << 20
    monkeypatch.setattr(system, "resource", None)
    assert system.peak_memory() is None
    system.check_address_space()
