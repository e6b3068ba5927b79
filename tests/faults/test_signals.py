"""A convert that is stopped at any moment leaves no output, the old one, or the complete new one.

Two hundred runs: three signals, with an old output and without, at moments spread over the whole run.
"""

import json
import os
import random
import signal
import subprocess
import sys
import time

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1200)]

RUNS = 34
OLD = b"the old output"
CONVERT = [
    sys.executable,
    "-m",
    "dmc_cli",
    "convert",
    "synth:iwp:100",
    "mesh.obj",
    "-i",
    "0",
    "--force",
    "--quiet",
]
STATUS = {  # as Popen tells it: negative if the signal struck before our handler was there, or after
    signal.SIGINT: {0, 130, -signal.SIGINT},
    signal.SIGTERM: {0, 143, -signal.SIGTERM},
    signal.SIGKILL: {0, -signal.SIGKILL},
}


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """The bytes of an undisturbed run, and the seconds it takes."""
    folder = tmp_path_factory.mktemp("complete")
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        subprocess.run(CONVERT, cwd=folder, check=True, timeout=200)
        seconds.append(time.perf_counter() - start)
    return (folder / "mesh.obj").read_bytes(), min(seconds)


def stopped_run(folder, number, delay):
    """Start a convert, send it a signal after `delay` seconds, and return its exit status and messages."""
    with subprocess.Popen(CONVERT, cwd=folder, stderr=subprocess.PIPE, encoding="utf-8") as run:
        try:
            run.wait(delay)
        except subprocess.TimeoutExpired:
            run.send_signal(number)
        return run.wait(60), run.stderr.read()


@pytest.mark.parametrize("has_old", [False, True], ids=["no-output", "old-output"])
@pytest.mark.parametrize("number", STATUS, ids=lambda number: number.name)
def test_an_output_is_whole_whenever_the_run_is_stopped(tmp_path, complete, number, has_old):
    expected, seconds = complete
    moments = random.Random(7)
    output, part = tmp_path / "mesh.obj", tmp_path / ".mesh.obj.dmc-part"
    outcomes = set()
    for n in range(RUNS):
        output.unlink(missing_ok=True)
        if has_old:
            output.write_bytes(OLD)
        moment = moments.uniform(0.02, 1.05 * seconds) if n else 5 * seconds  # the first one is not stopped
        status, messages = stopped_run(tmp_path, number, moment)
        assert status in STATUS[number], messages
        found = output.read_bytes() if output.exists() else None
        assert found in ((OLD if has_old else None), expected)
        if status == 0:
            assert found == expected
        assert set(os.listdir(tmp_path)) <= {"mesh.obj", ".mesh.obj.dmc-part"}
        if status > 0:
            assert not part.exists()
            assert "no output was left incomplete" in messages
            assert "Traceback" not in messages
        outcomes.add(status)
    assert len(outcomes) > 1, "the moments did not spread over the run"
    subprocess.run(CONVERT, cwd=tmp_path, check=True, timeout=200)
    assert output.read_bytes() == expected
    assert os.listdir(tmp_path) == ["mesh.obj"]


BATCH = ["synth:iwp:70", "synth:torus:70", "synth:neovius:70", "synth:sphere:70"]


def batch(folder, jobs, delay=None, number=None):
    """Run a batch, send it a signal after `delay` seconds; exit status, outcomes and messages."""
    words = [sys.executable, "-m", "dmc_cli", "batch", *BATCH, "-i", "0", "--force", "--jobs", str(jobs)]
    with subprocess.Popen(
        words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    ) as run:
        try:
            printed, messages = run.communicate(timeout=delay or 200)
        except subprocess.TimeoutExpired:
            run.send_signal(number)
            printed, messages = run.communicate(timeout=60)
    return run.returncode, [json.loads(line) for line in printed.splitlines()], messages


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_a_stopped_batch_leaves_whole_meshes(tmp_path, number, jobs):
    whole = tmp_path / "whole"
    whole.mkdir()
    batch(whole, jobs)
    start = time.perf_counter()
    assert batch(whole, jobs)[0] == 0
    seconds = time.perf_counter() - start
    expected = {path.name: path.read_bytes() for path in whole.iterdir()}
    assert len(expected) == len(BATCH)
    folder = tmp_path / "stopped"
    folder.mkdir()
    moments = random.Random(jobs)
    outcomes = set()
    for _ in range(10):
        status, lines, messages = batch(folder, jobs, moments.uniform(0.2, 1.0) * seconds, number)
        assert status in STATUS[number], messages
        assert "Traceback" not in messages
        found = {path.name: path.read_bytes() for path in folder.iterdir()}
        assert found.items() <= expected.items()  # no temporary file, no half a mesh
        assert {line["output"] for line in lines} <= set(found)
        outcomes.add(status)
        for name in found:
            (folder / name).unlink()
    assert outcomes & {130, 143}, "the moments did not strike while the batch ran"
