"""Without threads from the system everything is done all the same, by the one that there is."""

import json
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

from tests.conftest import ROOT


def run_with(threads, *words, folder):
    command = [sys.executable, "-m", "tests.faults.without_threads", str(threads), *map(str, words)]
    return subprocess.run(
        command,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=200,
    )


@pytest.mark.parametrize("threads", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_a_dicom_series_is_converted(tmp_path, sample_data, run, threads):
    words = [sample_data / "dicom" / "head_ct", "mesh.ply", "-i", 300, "--threads", 4, "--quiet"]
    result = run_with(threads, "convert", *words, folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    assert run("convert", words[0], tmp_path / "usual.ply", *words[2:]).exit_code == 0
    assert (tmp_path / "mesh.ply").read_bytes() == (tmp_path / "usual.ply").read_bytes()


@pytest.mark.parametrize("threads", [0, pytest.param(3, marks=pytest.mark.slow)])
def test_a_batch_of_several_jobs(tmp_path, threads):
    words = ["synth:torus:16", "synth:sphere:16", "synth:iwp:16", "-i", 0, "--jobs", 3]
    result = run_with(threads, "batch", *words, folder=tmp_path)
    assert result.returncode == 0, result.stderr
    outputs = [json.loads(line)["output"] for line in result.stdout.splitlines()]
    assert sorted(outputs) == sorted(os.listdir(tmp_path))
    assert len(outputs) == 3


def no_thread(thread):
    raise RuntimeError("can't start new thread")


@pytest.mark.parametrize(("verbose", "kind"), [(0, "SilentProgress"), (1, "LineProgress")])
def test_no_bar_is_drawn_on_a_terminal(monkeypatch, verbose, kind):
    from dmc_cli.cli.progress import shown_progress

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(threading.Thread, "start", no_thread)
    with shown_progress(quiet=False, verbose=verbose) as progress:
        assert type(progress).__name__ == kind
        with progress.stage("one"):
            progress.advance(0.5)


def test_a_bar_that_cannot_be_drawn_again_stays_away(monkeypatch):
    from dmc_cli.cli.progress import shown_progress

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with shown_progress(quiet=False, verbose=0) as progress:
        assert type(progress).__name__ == "BarProgress"
        monkeypatch.setattr(threading.Thread, "start", no_thread)
        with progress.hidden():
            pass
        progress.advance(0.5)


SWALLOWED = """
import os, signal, threading, time
from dmc_cli.cli.signals import raise_on_signals

class Thing:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.05)  # the handler runs here, and what it raises goes no further

def no_thread(thread):
    raise RuntimeError("can't start new thread")

raise_on_signals()
threading.Thread.start = no_thread
thing = Thing()
del thing
time.sleep(20)
"""


def test_a_signal_that_python_swallows_kills_at_once():
    run = subprocess.run([sys.executable, "-c", SWALLOWED], capture_output=True, timeout=60, check=False)
    assert run.returncode == -signal.SIGTERM


def test_an_input_is_refused_with_its_own_error(tmp_path):
    np.save(tmp_path / "flat.npy", np.zeros((1, 5, 5)))
    result = run_with(0, "convert", "flat.npy", "mesh.ply", "-i", 0, folder=tmp_path)
    assert result.returncode == 3
    assert "at least two along each axis" in result.stderr
