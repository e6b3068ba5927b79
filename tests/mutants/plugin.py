"""A plugin of pytest: records how long tests take, and runs chosen ones in a given order."""

import json
import os
from pathlib import Path

_SECONDS = {}


_FAILED = set()


def pytest_runtest_logreport(report):
    _SECONDS[report.nodeid] = _SECONDS.get(report.nodeid, 0.0) + report.duration
    if report.failed:
        _FAILED.add(report.nodeid)


def pytest_sessionfinish():
    if told := os.environ.get("MUTANTS_SECONDS"):
        found = {test: [seconds, test in _FAILED] for test, seconds in _SECONDS.items()}
        Path(told).write_text(json.dumps(found))


def pytest_collection_modifyitems(items):
    """Keep the chosen tests in their order, after those that no record knows: they are new."""
    if not (given := os.environ.get("MUTANTS_TESTS")):
        return
    plan = json.loads(Path(given).read_text("utf-8"))
    place = {test: n for n, test in enumerate(plan["chosen"])}
    known = set(plan["known"])
    kept = [item for item in items if item.nodeid in place or item.nodeid not in known]
    items[:] = sorted(kept, key=lambda item: place.get(item.nodeid, -1))
