"""Record for each test file which functions of the host code it runs, and how long it takes."""

import hashlib
import json
import os
import re
from collections import Counter, defaultdict
from pathlib import Path

from tests.mutants.child import run_pytest
from tests.mutants.graph import users
from tests.mutants.mutant import PACKAGE, ROOT
from tests.mutants.source import Source
from tests.mutants.tree import NO_TESTS, QUICK, WORK, environment

MAP, NOTICED = WORK / "map.json", WORK / "noticed.json"
"""What tests run, and how many faults each has noticed so far."""


def load_map():
    """Return what was recorded: of each test file its hash and tests, each with seconds and functions."""
    return json.loads(MAP.read_text("utf-8")) if MAP.exists() else {}


def hash_of(tree, file):
    """Return a hash of a test file, which tells whether its tests are those that were recorded."""
    return hashlib.sha256((tree / file).read_bytes()).hexdigest()


def is_changed(recorded, tree, file):
    """Return whether a test file is another one than when it was recorded."""
    return recorded[file]["hash"] != hash_of(tree, file)


def record(tree, files):
    """Run test files under coverage in a tree and add what they tell to the map.

    A test that fails without any fault is never chosen, and said to be left out.
    """
    data, told = WORK / "recorded.coverage", WORK / "recorded.json"
    settings = environment(tree) | {"COVERAGE_FILE": str(data), "MUTANTS_SECONDS": str(told)}
    for file in files:
        arguments = ["-q", *QUICK, "-p", "tests.mutants.plugin", f"--cov={PACKAGE}", "--cov-context=test"]
        status, text = run_pytest(tree, [*arguments, "--cov-report=", file], settings)
        left_out = "" if status in (0, NO_TESTS) else "; what failed is left out"
        print(f"recorded {file}: {text.strip().splitlines()[-1]}{left_out}", flush=True)
        seconds = json.loads(told.read_text("utf-8")) if told.exists() else {}
        functions = _functions_by_test(tree, data)
        tests = {
            test: {"seconds": taken, "functions": [] if failed else sorted(functions[test])}
            for test, (taken, failed) in seconds.items()
        }
        MAP.write_text(json.dumps(load_map() | {file: {"hash": hash_of(tree, file), "tests": tests}}))
        for path in (data, told):
            path.unlink(missing_ok=True)


def _functions_by_test(tree, data):
    from coverage import CoverageData

    coverage, result = CoverageData(basename=str(data)), defaultdict(set)
    if not data.exists():
        return result
    coverage.read()
    for path in coverage.measured_files():
        file = os.path.relpath(path, tree / PACKAGE)
        source = Source(file, (tree / PACKAGE / file).read_text("utf-8"))
        for line, contexts in coverage.contexts_by_lineno(path).items():
            symbol = source.body_at(line)
            if symbol:
                for context in contexts:
                    result[context.split("|")[0]].add(f"{file}::{symbol}")
    return result


class Choice:
    """Chooses the tests for a fault, those most likely to notice it first."""

    def __init__(self, recorded):
        self.users = users()
        self.noticed = Counter(json.loads(NOTICED.read_text("utf-8")) if NOTICED.exists() else {})
        self.seconds = {}
        self.tests = defaultdict(set)
        for facts_of_file in recorded.values():
            for test, facts in facts_of_file["tests"].items():
                self.seconds[test] = facts["seconds"]
                for function in facts["functions"]:
                    self.tests[function].add(test)

    def tests_for(self, file, symbol, files, most_seconds):
        """Tests in the order in which to run them, within a time; `files` are those of the area."""
        name = Path(file).stem
        found = self._reaching(f"{file}::{symbol}")
        if not self.tests[f"{file}::{symbol}"]:  # a test may read a constant without a function
            readers = {home for home in files if re.search(rf"\b{name}\b", (ROOT / home).read_text("utf-8"))}
            found |= {test for test in self.seconds if test.split("::")[0] in readers}
        found = found or {test for test in self.seconds if test.split("::")[0] in files}

        def rank(test):
            home = test.split("::")[0]
            same = home.endswith(f"test_{name}.py") or name.startswith(
                home.rsplit("/", 1)[-1].removeprefix("test_").removesuffix(".py")
            )
            worth = self.noticed[test] / (1.0 + self.seconds[test])
            return not same, home not in files, -worth, self.seconds[test], test

        chosen, taken = [], 0.0
        for test in sorted(found, key=rank):
            if taken + self.seconds[test] <= most_seconds:
                chosen.append(test)
                taken += self.seconds[test]
        return chosen, taken

    def learn(self, told):
        """Note which test has noticed a fault: it may well notice the next one."""
        for test in re.findall(r"^FAILED (.+?)(?: - |$)", told, re.MULTILINE):
            self.noticed[test] += 1
        NOTICED.write_text(json.dumps(self.noticed))

    def _reaching(self, start):
        """Tests that run a function, or else what uses it, and so on."""
        seen, ahead, result = {start}, [start], set()
        while ahead:
            symbol = ahead.pop()
            if self.tests[symbol]:
                result |= self.tests[symbol]
                continue
            for user in self.users[symbol] - seen:
                seen.add(user)
                ahead.append(user)
        return result
