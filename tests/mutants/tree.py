"""A copy of the project in which a fault is put, and the tests run there."""

import json
import os
import re
import shutil
import time
from pathlib import Path

from tests.mutants.child import run_pytest
from tests.mutants.mutant import PACKAGE, ROOT

WORK = ROOT / "build" / "mutants"
KERNELS = WORK / "kernels"
"""Compiled kernels of all faults, apart from a user's."""

QUICK = ["-m", "not slow and not gpu", "-p", "no:cacheprovider"]
COPIED = (PACKAGE, "tests")
NO_TESTS = 5  # what pytest returns
STILLBORN = re.compile(
    r"WarpCodegen\w*Error|Warp build error|Failed to build|error: (?:use of|no matching|expected)"
)
"""What shows that the text with the fault does not even compile: that is no fault that a test has to find."""


def make_tree(name):
    """Make a folder with a copy of package and tests, and links to the rest and what lies beside it."""
    tree = WORK / name
    for part in COPIED:
        shutil.rmtree(tree / part, ignore_errors=True)
        shutil.copytree(ROOT / part, tree / part, ignore=shutil.ignore_patterns("__pycache__"))
    for path in ROOT.iterdir():
        if (
            path.name not in (*COPIED, "build", ".git")
            and not path.name.startswith(".")
            and not (tree / path.name).exists()
        ):
            (tree / path.name).symlink_to(path)
    beside = ROOT.parent / "shared"
    if beside.is_dir() and not (WORK / "shared").exists():
        (WORK / "shared").symlink_to(beside)
    return tree


def warm_kernels():
    """Begin with the kernels that are compiled already, if the environment says where."""
    if warm := os.environ.get("WARP_CACHE_PATH"):
        for path in Path(warm).rglob("wp_*"):
            target = KERNELS / path.relative_to(warm)
            if path.is_dir() and not target.exists():
                shutil.copytree(path, target, dirs_exist_ok=True)


def environment(tree):
    """Return what the environment of a run in a tree has of its own."""
    return {"PYTHONPATH": str(tree), "WARP_CACHE_PATH": str(KERNELS)}


def write_module(tree, file, text):
    """Write a module so that Python does not take what it compiled of an earlier text."""
    path = tree / PACKAGE / file
    for old in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
        old.unlink()
    path.write_text(text, "utf-8")


def run_tests(tree, chosen, known, files, limit):
    """Run chosen tests in a tree and those of `files` that are not known yet.

    Returns:
        What became of the fault, the seconds, and the last lines.
    """
    plan = tree / "plan.json"
    plan.write_text(json.dumps({"chosen": chosen, "known": known}))
    homes = dict.fromkeys([*files, *(test.split("::")[0] for test in chosen)])
    arguments = ["-x", "-q", "--tb=short", "--timeout=60", *QUICK, "-p", "tests.mutants.plugin"]
    arguments += [home for home in homes if (tree / home).exists()]
    start = time.monotonic()
    settings = environment(tree) | {"MUTANTS_TESTS": str(plan)}
    status, told = run_pytest(tree, arguments, settings, limit)
    outcome = "timeout" if status is None else "survived" if status in (0, NO_TESTS) else "killed"
    if outcome == "killed" and STILLBORN.search(told):
        outcome = "stillborn"
    return outcome, time.monotonic() - start, told[-3000:]
