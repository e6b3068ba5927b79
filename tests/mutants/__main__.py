"""`python -m tests.mutants`: put faults into an area of the package, one at a time, and run its tests.

Which tests run what is recorded once, in `build/mutants`; tests that came since are always run.
"""

import argparse
import queue
import sys
import threading
import time
from collections import Counter
from dataclasses import replace

from tests.mutants.areas import AREAS, area_of, files_of, files_with_tests_of
from tests.mutants.coverage_map import Choice, is_changed, load_map, record
from tests.mutants.mutant import PACKAGE, ROOT, sample
from tests.mutants.python_faults import faults_of
from tests.mutants.tree import WORK, make_tree, run_tests, warm_kernels, write_module

OUTCOMES = ("killed", "timeout", "survived", "stillborn")


def main():
    chosen = parse()
    texts, mutants = chosen_mutants(chosen)
    if chosen.list:
        print(*mutants, sep="\n")
        return 0
    WORK.mkdir(parents=True, exist_ok=True)
    warm_kernels()
    trees = [make_tree(f"tree{n}") for n in range(chosen.jobs)]
    areas = sorted({area_of(m.file) for m in mutants})
    recorded = load_map()
    files = sorted({file for area in areas for file in files_with_tests_of(area)})
    missing = [f for f in files if f not in recorded or (chosen.record and is_changed(recorded, trees[0], f))]
    record(trees[0], missing)
    recorded = load_map()
    changed = [file for file in files if is_changed(recorded, trees[0], file)]
    trial = Trial(texts, chosen.most_seconds, Choice(recorded), changed)
    if not trial.passes_without_fault(mutants, trees):
        return 1
    trial.run_all(mutants, trees)
    print_table(trial.results)
    return 0


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--area", choices=AREAS, action="append", help="may be given again; all without")
    parser.add_argument(
        "--files", nargs="+", default=[], help="of these files only; `name.py:10-20` of these lines"
    )
    parser.add_argument("--count", type=int, default=60, help="faults in all (%(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--match", default="", help="only faults whose line of --list has this in it")
    parser.add_argument("--jobs", type=int, default=1, help="faults at a time (%(default)s)")
    parser.add_argument(
        "--most-seconds", type=float, default=60, help="of tests a fault, as recorded (%(default)s)"
    )
    parser.add_argument(
        "--record", action="store_true", help="record anew what the tests of changed files run"
    )
    parser.add_argument("--list", action="store_true", help="list the faults and leave")
    return parser.parse_args()


def chosen_mutants(chosen):
    """Return the texts of the files as they are now, and the faults that were asked for."""
    ranges = {}
    for name in chosen.files:
        file, _, lines = name.partition(":")
        first, _, last = lines.partition("-")
        ranges[file] = (int(first or 1), int(last or first or 10**9))
    texts, found = {}, []
    for area in chosen.area or AREAS:
        for file in files_of(area, tuple(ranges)):
            texts[file] = (ROOT / PACKAGE / file).read_text("utf-8")
            faults = faults_of(file, texts[file])
            low, high = next((r for name, r in ranges.items() if file.endswith(name)), (1, 10**9))
            found += [f for f in faults if low <= f.line <= high and chosen.match in str(f)]
    return texts, sample(found, chosen.count, chosen.seed)


class Trial:
    """Puts faults into trees and runs the tests, as many at a time as there are trees."""

    def __init__(self, texts, most_seconds, choice, changed):
        self.texts, self.most_seconds, self.choice, self.changed = texts, most_seconds, choice, changed
        self.results = []

    def passes_without_fault(self, mutants, trees):
        """Return whether the tests of the first and last fault pass where there is none."""
        for tree, mutant in zip([*trees, trees[0]], [*mutants[:1] * len(trees), *mutants[-1:]], strict=True):
            outcome, _, told = self.attempt(replace(mutant, new=mutant.old), tree)
            if outcome != "survived":
                print(told, "the tests do not pass without any fault", file=sys.stderr, sep="\n")
                return False
        return True

    def run_all(self, mutants, trees):
        waiting = queue.SimpleQueue()
        for n, mutant in enumerate(mutants):
            waiting.put((f"{n + 1}/{len(mutants)}", mutant))
        threads = [threading.Thread(target=self._work, args=(waiting, tree)) for tree in trees]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def _work(self, waiting, tree):
        while not waiting.empty():
            try:
                number, mutant = waiting.get_nowait()
            except queue.Empty:
                return
            outcome, seconds, told = self.attempt(mutant, tree)
            self.results.append((mutant, outcome))
            self.choice.learn(told)
            lines = told.strip().splitlines() or ["the run ended without a word"]  # as one that crashed may
            reason = "" if outcome == "survived" else lines[-1][:110]
            print(f"{number} {outcome} {seconds:.0f} s {mutant} | {reason}", flush=True)

    def attempt(self, mutant, tree):
        """Run the tests against a fault; the tree is as before afterwards."""
        text = self.texts[mutant.file]
        files = files_with_tests_of(area_of(mutant.file))
        tests, seconds = self.choice.tests_for(mutant.file, mutant.symbol, files, self.most_seconds)
        write_module(tree, mutant.file, mutant.put_into(text))
        try:
            changed = [file for file in files if file in self.changed]
            return run_tests(tree, tests, list(self.choice.seconds), changed, 90 + 2 * seconds)
        finally:
            write_module(tree, mutant.file, text)


def print_table(results):
    """Print how many faults of each area were noticed, then those that were not."""
    print(f"\n| area | {' | '.join(OUTCOMES)} | noticed |\n|{' --- |' * (len(OUTCOMES) + 2)}")
    for area in sorted({area_of(m.file) for m, _ in results}):
        counts = Counter(outcome for m, outcome in results if area_of(m.file) == area)
        noticed, alive = counts["killed"] + counts["timeout"], counts["survived"]
        share = f"{100 * noticed / max(noticed + alive, 1):.0f} %"
        print(f"| {area} | {' | '.join(str(counts[o]) for o in OUTCOMES)} | {share} |")
    print(f"\n{time.strftime('%Y-%m-%d')}; not noticed:")
    for mutant, outcome in sorted(results):
        if outcome == "survived":
            print(f"- {mutant}")


if __name__ == "__main__":
    sys.exit(main())
