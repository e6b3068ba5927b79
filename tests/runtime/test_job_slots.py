"""Job slots are given to whoever launches, and the board of them is laid out as the C++ has it."""

import re
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import pytest

from dmc_cli.runtime import job_slots, worker_pool
from tests.runtime.launcher import Launcher, visits_of


@pytest.mark.pool
def test_more_callers_than_slots_are_served(monkeypatch):
    monkeypatch.setattr(worker_pool.job_slots, "MOST_SLOTS", 2)
    shared = Launcher(2)
    with ThreadPoolExecutor(6) as pool:
        runs = [pool.submit(visits_of, shared, 3000, 10, 1, 50, ahead) for ahead in 6 * [True, False]]
        assert all((run.result()[:3000] == 50).all() for run in runs)
    assert len(shared.pool._slots) == 2


@pytest.mark.pool
def test_slots_are_given_back_by_threads_that_end():
    shared = Launcher(2)
    for _ in range(5):
        with ThreadPoolExecutor(1) as pool:
            assert (pool.submit(visits_of, shared, 1000, 10).result()[:1000] == 1).all()
    assert len(shared.pool._slots) == 1


def test_the_board_keeps_what_threads_write_apart():
    entries = [job_slots.OPEN, job_slots.INSIDE, job_slots.JOB, job_slots.PARTS, job_slots.SLOT]
    assert all(b - a >= job_slots.LINE for a, b in pairwise(entries))
    assert job_slots.DONE < job_slots.PARTS
    assert job_slots.CLOCK_ID < job_slots.FIRST_SLOT
    assert job_slots.SLOT % job_slots.LINE == job_slots.FIRST_SLOT % job_slots.LINE == 0
    assert worker_pool.make_board().ptr % (8 * job_slots.LINE) == 0


def places_in_cpp():
    """Of each struct of the header the names of its fields, with their places in entries, and its size."""
    header = Path(job_slots.__file__).with_suffix(".h").read_text("utf-8")
    sizes, places = {"long long": 1}, {}
    for struct, body in re.findall(r"^struct (\w+) \{\n(.*?)^\};", header, re.MULTILINE | re.DOTALL):
        end = 0
        for kind, name, count in re.findall(r"^ +([\w ]+) (\w+)(?:\[(\d+)\])?;", body, re.MULTILINE):
            places[struct, name] = end
            end += sizes[kind] * int(count or 1)
        sizes[struct] = end
    return places, sizes


def test_the_board_is_laid_out_alike_in_both_languages():
    places, sizes = places_in_cpp()
    assert sizes == {
        "long long": 1,
        "Part": job_slots.LINE,
        "Slot": job_slots.SLOT,
        "Board": job_slots.BOARD,
    }
    assert places["Part", "end"] == 1
    assert places["Board", "slots"] == job_slots.FIRST_SLOT
    named = {key: n for key, n in places.items() if not re.search("rest_|after_|^slots$", key[1])}
    assert len(named) == 2 + 13 + 5
    for (struct, name), place in named.items():
        if struct != "Part":
            assert place == getattr(job_slots, name.upper()), name
