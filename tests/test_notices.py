"""Warnings have codes that scripts can rely on, and `--strict` refuses those about meaning."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, CallError
from dmc_cli.notices import (
    ABOUT_MEANING,
    ABOUT_THE_RUN,
    CODES,
    Notice,
    notices,
    refuse_uncertain,
    warning_keys,
)

PACKAGE = Path(__file__).resolve().parent.parent / "dmc_cli"


@pytest.fixture
def unplaced(tmp_path):
    """Return an array of two values that tells no spacing."""
    values = np.zeros((6, 6, 6), np.float32)
    values[2:4, 2:4, 2:4] = 1
    np.save(tmp_path / "a.npy", values)
    return tmp_path / "a.npy"


def test_codes_have_one_form_and_one_meaning():
    assert all(re.fullmatch(r"W(-[A-Z]+)+", code) for code in CODES)
    assert not ABOUT_MEANING.keys() & ABOUT_THE_RUN.keys()
    assert len(set(CODES.values())) == len(CODES)


def test_every_code_is_used_somewhere():
    text = "".join(path.read_text() for path in PACKAGE.rglob("*.py") if path.name != "notices.py")
    assert {code for code in CODES if f'"{code}"' not in text} == set()


def test_a_code_that_is_in_no_table_is_refused():
    with pytest.raises(CallError, match="W-NONE"):
        Notice("W-NONE", "told")


def test_only_notices_about_meaning_are_refused():
    run = notices("W-NO-DATA", ["one", "two"])
    refuse_uncertain(run, "a.nrrd")
    with pytest.raises(AmbiguousVolumeError, match=r"^a.nrrd: three \(W-UNIT-UNKNOWN\); --strict expects"):
        refuse_uncertain([*run, Notice("W-UNIT-UNKNOWN", "three")], "a.nrrd")


def test_a_report_has_a_code_for_each_sentence():
    assert warning_keys([Notice("W-NO-DATA", "one"), Notice("W-UNIT-UNKNOWN", "two")]) == {
        "warnings": ["one", "two"],
        "warning_codes": ["W-NO-DATA", "W-UNIT-UNKNOWN"],
    }


def test_the_report_and_the_description_tell_codes(unplaced, tmp_path, run):
    report = tmp_path / "a.json"
    result = run("convert", unplaced, tmp_path / "a.off", "-i", 0.5, "--report", report, "--series", 1)
    assert result.exit_code == 0
    told = json.loads(report.read_text())
    assert told["warning_codes"] == ["W-OPTION-UNUSED", "W-SPACING-MISSING", "W-NORMALS-LEFT-OUT"]
    assert len(told["warnings"]) == 3
    described = json.loads(run("info", unplaced, "--json").stdout)
    assert described["warning_codes"] == ["W-SPACING-MISSING"]
    (line,) = run("batch", unplaced, "-i", 0.5, "-o", tmp_path / "{stem}_2.ply", "-q").stdout.splitlines()
    assert json.loads(line)["warning_codes"] == ["W-SPACING-MISSING"]
    words = ["--volume", unplaced, "-i", 0.5, "--json"]
    assert json.loads(run("measure", tmp_path / "a.off", *words).stdout)["warning_codes"] == [
        "W-SPACING-MISSING"
    ]


@pytest.mark.parametrize(
    "words",
    [
        ["convert", "{volume}", "{output}", "-i", 0.5],
        ["info", "{volume}"],
    ],
)
def test_strict_ends_with_status_4_and_writes_nothing(words, unplaced, tmp_path, run):
    output = tmp_path / "new" / "a.ply"
    output.parent.mkdir()
    words = [str(word).format(volume=unplaced, output=output) for word in words]
    result = run(*words, "--strict")
    assert result.exit_code == 4
    assert "W-SPACING-MISSING" in result.stderr
    assert "--spacing" in result.stderr
    assert not list(output.parent.iterdir())
    assert run(*words, "--strict", "--spacing", "1,1,1").exit_code == 0
