"""Which tests run which functions of the host code, and how long they take: recorded once a test file."""

import json
import os
import subprocess
import sys
from collections import defaultdict

from tests.mutants.graph import users
from tests.mutants.mutant import PACKAGE
from tests.mutants.source import Source
from tests.mutants.tree import QUICK, WORK, environment

MAP = WORK / "map.json"


def load_map():
    """What was recorded: for each test file its tests, each with its seconds and its functions."""
    return json.loads(MAP.read_text()) if MAP.exists() else {}


def record(tree, files):
    """Run test files under coverage in a tree, and add what they tell to the map."""
    data, told = WORK / f"coverage.{os.getpid()}", WORK / f"seconds.{os.getpid()}.json"
    command = [sys.executable, "-m", "pytest", "-q", *QUICK, "-p", "tests.mutants.plugin", f"--cov={PACKAGE}"]
    command += ["--cov-context=test", "--cov-report=", *files]
    settings = {"COVERAGE_FILE": str(data), "MUTANTS_SECONDS": str(told)}
    done = subprocess.run(command, cwd=tree, env=environment(tree) | settings, check=False)
    seconds = json.loads(told.read_text()) if told.exists() else {}
    functions = _functions_by_test(tree, data)
    found = load_map()
    for file in files:
        found[file] = {}
    for test, taken in seconds.items():
        found[test.split("::")[0]][test] = {"seconds": taken, "functions": sorted(functions[test])}
    MAP.write_text(json.dumps(found))
    for path in (data, told):
        path.unlink(missing_ok=True)
    return done.returncode


def _functions_by_test(tree, data):
    from coverage import CoverageData

    coverage, result = CoverageData(basename=str(data)), defaultdict(set)
    coverage.read()
    for path in coverage.measured_files():
        file = os.path.relpath(path, tree / PACKAGE)
        source = Source(file, (tree / PACKAGE / file).read_text())
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
        self.seconds = {}
        self.tests = defaultdict(set)
        for tests in recorded.values():
            for test, facts in tests.items():
                self.seconds[test] = facts["seconds"]
                for function in facts["functions"]:
                    self.tests[function].add(test)

    def tests_for(self, file, symbol, files, most_seconds):
        """Tests in the order in which to run them, within a time; `files` are those of the area."""
        found = self._reaching(f"{file}::{symbol}") or {t for t in self.seconds if t.split("::")[0] in files}
        name = file.rsplit("/", 1)[-1].removesuffix(".py")

        def rank(test):
            home = test.split("::")[0]
            same = home.endswith(f"test_{name}.py") or name.startswith(
                home.rsplit("/", 1)[-1].removeprefix("test_").removesuffix(".py")
            )
            return not same, home not in files, self.seconds[test], test

        chosen, taken = [], 0.0
        for test in sorted(found, key=rank):
            if taken + self.seconds[test] <= most_seconds:
                chosen.append(test)
                taken += self.seconds[test]
        return chosen, taken

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
