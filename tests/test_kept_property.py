"""A kept property: evaluated once, the same for all threads, and no obstacle to a process that forks."""

import ast
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import dmc_cli
from dmc_cli.kept_property import kept_property

FORK = """
import os, signal, threading
import numpy as np
from dmc_cli.contouring.stages.edge_ranks import EdgeRanks
from dmc_cli.field.grid import GridShape
from dmc_cli.volume.suggestions import Suggestions
from tests.fields import volume_of

class Long:
    def numpy(self):
        return self

    def sum(self, dtype):
        return sum(range(2000))

VOLUME = volume_of(np.arange(8, dtype=np.uint8).reshape(2, 2, 2))

def evaluate():
    ranks = EdgeRanks(None, None, None, None, 0, 0, 0, Long())
    return ranks.active_cells, GridShape(2, 3, 4, 0).struct().nx, Suggestions(VOLUME).is_mask

def keep_on():
    while not ended.is_set():
        evaluate()

expected = evaluate()
ended = threading.Event()
thread = threading.Thread(target=keep_on, daemon=True)
thread.start()
for _ in range(60):
    child = os.fork()
    if child == 0:
        signal.alarm(20)  # ends one that hangs
        os._exit(0 if evaluate() == expected else 1)
    assert os.waitpid(child, 0)[1] == 0
ended.set()
thread.join()
print("done")
"""


class Box:
    def __init__(self):
        self.evaluations = 0

    @kept_property
    def content(self):
        """Return what is in it."""
        self.evaluations += 1
        return [self.evaluations]


def test_it_is_evaluated_once_for_each_object():
    first, second = Box(), Box()
    assert first.content is first.content
    assert first.content is not second.content
    assert first.evaluations == second.evaluations == 1


def test_the_class_shows_it_with_its_words():
    assert isinstance(Box.content, kept_property)
    assert Box.content.__doc__ == "Return what is in it."


def test_threads_that_ask_at_the_same_time_get_the_same_value():
    both_inside = threading.Barrier(2, timeout=60)

    class Slow:
        @kept_property
        def content(self):
            both_inside.wait()
            return object()

    slow, found = Slow(), []
    threads = [threading.Thread(target=lambda: found.append(slow.content)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [slow.content] * 2


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_children_of_a_process_with_a_thread_that_evaluates_can_evaluate():
    words = [sys.executable, "-W", "ignore", "-c", FORK]
    run = subprocess.run(words, capture_output=True, encoding="utf-8", timeout=60, check=False)
    assert run.stdout == "done\n", run.stderr


def test_nothing_here_holds_the_lock_of_functools():
    package = Path(dmc_cli.__file__).parent
    names = {
        alias.name
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_bytes()))
        if isinstance(node, ast.ImportFrom) and node.module == "functools"
        for alias in node.names
    }
    assert "cache" in names
    assert "cached_property" not in names
