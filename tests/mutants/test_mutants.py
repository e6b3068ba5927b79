"""The sampler puts faults where code is, all of them, and chooses the tests that can notice them."""

import ast
from types import SimpleNamespace

import pytest

from tests.mutants.__main__ import Trial
from tests.mutants.areas import AREAS, NO_EFFECT, files_of, files_with_tests_of
from tests.mutants.coverage_map import Choice
from tests.mutants.graph import users
from tests.mutants.mutant import CONSTANTS, PACKAGE, ROOT, SHARE_OF_CONSTANTS, sample
from tests.mutants.python_faults import faults_of
from tests.mutants.tree import run_tests, write_module

MODULE = '''"""Docstring with 3 < 4."""

import warp as wp

wp.set_module_options({"max_unroll": 0})

LEAST: int = 5
"""A constant; 6 + 7 is text."""


@wp.func_native(
    """
    // a comment with a < b
    if (a < 3) return b;
    """
)
def native(a: wp.int32, b: wp.int32) -> wp.int32:
    ...


WORDS_A_CHUNK = 32


def host(é, b, limit=2):
    """Docstring: 1 + 1."""
    if b < limit and é:
        raise ValueError(f"{b} is below {limit + 1}")
    total = min(b, é) + zipped(é, b, strict=True) + LEAST
    total = total * 2
    prefetch_ahead(total)
    launch(total, 16 * WORDS_A_CHUNK)
    return total
'''


def found():
    return {(m.line, m.kind, m.old, m.new) for m in faults_of("module.py", MODULE)}


@pytest.mark.parametrize(
    "fault",
    [
        (7, CONSTANTS, "5", "6"),
        (14, "C++ comparison", " < ", " <= "),
        (14, "C++ number", "3", "4"),
        (14, "C++ condition", "a < 3", "true"),
        (24, CONSTANTS, "2", "3"),
        (26, "comparison", "<", "<="),
        (26, "logic", "and", "or"),
        (26, "logic", "b < limit and é", "(é)"),
        (26, "condition", "b < limit and é", "not (b < limit and é)"),
        (27, "refusal", 'raise ValueError(f"{b} is below {limit + 1}")', "pass"),
        (28, "call", "min", "max"),
        (28, "call", "é, b", "b, é"),
        (28, "arithmetic", "+", "-"),
        (29, "statement", "total = total * 2", "pass"),
    ],
)
def test_faults_of_every_kind_are_found(fault):
    assert fault in found()


def test_texts_options_and_messages_are_left_alone():
    lines = {line for line, *_ in found()}
    assert lines.isdisjoint({1, 3, 5, 8, 13, 16, 17, 21, 25, 30})
    assert (31, CONSTANTS, "16", "17") not in found()
    assert not any("limit + 1" in old and kind == "arithmetic" for _, kind, old, _ in found())


def test_what_has_no_effect_is_left_alone():
    assert (28, "call", "b, é", "é, b") not in found()
    assert (28, CONSTANTS, "True", "False") not in found()


def test_every_file_of_the_package_is_of_one_area():
    found = sorted(file for area in AREAS for file in files_of(area))
    package = ROOT / PACKAGE
    modules = (path for suffix in ("py", "h") for path in package.rglob(f"*.{suffix}"))
    expected = {path.relative_to(package).as_posix() for path in modules} - set(NO_EFFECT)
    assert found == sorted(expected)


@pytest.mark.parametrize("area", AREAS)
def test_every_fault_of_the_package_says_where_it_is_and_those_of_modules_are_python(area):
    assert all(list(ROOT.glob(name)) for name in AREAS[area].tests)
    assert files_with_tests_of(area)
    mutants = [
        f for file in files_of(area) for f in faults_of(file, (ROOT / PACKAGE / file).read_text("utf-8"))
    ]
    for mutant in sample(mutants, 40, seed=1):
        text = (ROOT / PACKAGE / mutant.file).read_text("utf-8")
        changed = mutant.put_into(text)
        assert changed != text
        if mutant.file.endswith(".py"):
            ast.parse(changed)
        assert text[mutant.start : mutant.end] == mutant.old


def test_a_sample_is_the_same_for_a_seed_and_not_full_of_constants():
    mutants = faults_of(
        "processing/remeshing/sweep.py", (ROOT / PACKAGE / "processing/remeshing/sweep.py").read_text("utf-8")
    )
    first, again, other = sample(mutants, 40, 1), sample(mutants[::-1], 40, 1), sample(mutants, 40, 2)
    assert first == again != other
    assert len(first) == len({(m.start, m.end) for m in first}) == 40
    assert sum(m.kind == CONSTANTS for m in first) <= SHARE_OF_CONSTANTS * 40


HEADER = """// a < b
#include "dmc_cli/bits/bit_lists.h"

namespace words {

static CUDA_CALLABLE int half(int a) { return a / 2; }

}  // namespace words

template <int N>
inline int first(wp::array_t<3, wp::int32> a,
                 int b) {
#if defined(A) && defined(B)
    if (b < N) {
        b += 1;
    }
#endif
    return words::half(b);  // 2 + 3
}
"""


def test_faults_of_headers_are_in_their_functions():
    faults = {(m.line, m.symbol, m.kind, m.old, m.new) for m in faults_of("bits/words.h", HEADER)}
    assert faults == {
        (6, "half", "C++ arithmetic", " / ", " * "),
        (6, "half", "C++ number", "2", "3"),
        (14, "first", "C++ comparison", " < ", " <= "),
        (14, "first", "C++ comparison", " < ", " > "),
        (14, "first", "C++ condition", "b < N", "true"),
        (14, "first", "C++ condition", "b < N", "false"),
        (15, "first", "C++ arithmetic", " += ", " -= "),
        (15, "first", "C++ number", "1", "2"),
    }


def test_headers_are_of_the_areas_and_reach_what_launches_their_kernels():
    headers = {file for area in AREAS for file in files_of(area) if file.endswith(".h")}
    package = ROOT / PACKAGE
    assert headers == {p.relative_to(package).as_posix() for p in package.rglob("*.h")} - {*NO_EFFECT}
    used = users()
    assert used["processing/patterns/masks.h::find_pattern"] == {
        "processing/patterns/masks.py::word_3x3y",
        "processing/patterns/masks.py::word_3333",
    }
    assert "field/cell_lists.h::store_cells" in used["bits/bit_lists.h::list_bits"]


def recorded(name, seconds, function):
    return {f"{name}": {"seconds": seconds, "functions": [function]}}


RECORDED = {
    "tests/mesh/test_other.py": {
        "tests": recorded(
            "tests/mesh/test_other.py::slow", 50.0, "processing/patterns/simplification.py::_safe_3x3y"
        )
        | recorded("tests/mesh/test_other.py::fast", 1.0, "processing/patterns/simplification.py::_safe_3x3y")
        | recorded("tests/mesh/test_other.py::elsewhere", 0.1, "mesh/check.py::check_mesh")
    },
    "tests/processing/patterns/test_simplify.py": {
        "tests": recorded(
            "tests/processing/patterns/test_simplify.py::same_name",
            5.0,
            "processing/patterns/simplify_3x3y.py::judge_topology",
        )
    },
}


def test_a_fault_in_a_kernel_is_shown_to_the_tests_that_launch_it():
    choice = Choice(RECORDED)
    chosen, seconds = choice.tests_for("processing/patterns/simplify_3x3y.py", "safe_cut", [], 60)
    assert chosen == ["tests/processing/patterns/test_simplify.py::same_name"]
    assert seconds == 5
    chosen, _ = choice.tests_for("processing/patterns/simplification.py", "_safe_3x3y", [], 60)
    assert [c.split("::")[1] for c in chosen] == ["fast", "slow"]
    assert choice.tests_for("processing/patterns/simplification.py", "_safe_3x3y", [], 2)[1] == 1


def test_a_fault_in_a_constant_is_shown_to_the_tests_that_read_its_module():
    files = ["tests/processing/patterns/test_simplify.py", "tests/bits/test_selection.py"]
    recorded_too = RECORDED | {
        files[1]: {"tests": recorded(f"{files[1]}::plain", 1.0, "mesh/other.py::none")}
    }
    chosen, _ = Choice(recorded_too).tests_for("bits/selection.py", "SHORT", files, 60)
    assert chosen[0] == f"{files[1]}::plain"


@pytest.mark.slow
def test_a_fault_that_a_test_notices_is_killed(tmp_path):
    (tmp_path / PACKAGE).mkdir()
    (tmp_path / PACKAGE / "__init__.py").touch()
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\nmarkers = ['slow', 'gpu']\n")
    text = "LEAST = 5\n"
    test = tmp_path / "test_it.py"
    test.write_text(f"from {PACKAGE} import it\ndef test(): assert it.LEAST >= 5\n", "utf-8")
    outcomes = []
    for fault in ("4", "6"):
        write_module(tmp_path, "it.py", text.replace("5", fault))
        outcomes.append(run_tests(tmp_path, [], [], ["test_it.py"], 300)[0])
    assert outcomes == ["killed", "survived"]


def test_a_run_that_crashes_without_a_word_ends_no_sample(monkeypatch, capsys):
    trial = Trial({}, 60, SimpleNamespace(learn=lambda told: None), [])
    monkeypatch.setattr(trial, "attempt", lambda mutant, tree: ("killed", 1.0, " \n"))
    trial.run_all(["one", "two"], ["tree"])
    assert [line.split(" | ")[0] for line in capsys.readouterr().out.splitlines()] == [
        "1/2 killed 1 s one",
        "2/2 killed 1 s two",
    ]
