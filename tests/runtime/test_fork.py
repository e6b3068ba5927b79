"""A process that forks while a thread extracts: its children extract, too."""

import subprocess
import sys

EXTRACT = """
import multiprocessing, sys, threading
import numpy as np
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.contouring import extract_surface
from dmc_cli.field import upload_volume
from tests.fields import white_noise

NOISE = white_noise(40)
device = select_device("cpu", 3)

def extract(_=None):
    surface = extract_surface(upload_volume(NOISE, device), SurfaceSettings(isovalue=0.0))
    return surface.mesh.faces.numpy().tobytes() + surface.mesh.positions.numpy().tobytes()

def keep_on():
    while not ended.is_set():
        results.add(extract())

expected = extract()
ended, results = threading.Event(), set()
thread = threading.Thread(target=keep_on)
thread.start()
fork = multiprocessing.get_context("fork")
for _ in range(6):
    with fork.Pool(2) as pool:
        assert pool.map(extract, range(4), chunksize=1) == 4 * [expected]
ended.set()
thread.join()
assert results == {expected}
print("done")
"""


def test_children_of_a_process_with_a_thread_that_extracts_can_extract():
    words = [sys.executable, "-W", "ignore", "-c", EXTRACT]
    run = subprocess.run(words, capture_output=True, encoding="utf-8", timeout=200, check=False)
    assert run.stdout == "done\n", run.stderr
