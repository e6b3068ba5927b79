"""Warnings have codes that scripts can rely on, and `--strict` refuses those about meaning."""

import json
import re
from dataclasses import replace
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
from dmc_cli.volume_io import numpy_file

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
    text = "".join(path.read_text("utf-8") for path in PACKAGE.rglob("*.py") if path.name != "notices.py")
    assert {code for code in CODES if f'"{code}"' not in text} == set()


def test_every_code_is_named_by_a_test_that_provokes_it():
    own = {"test_notices.py"}
    tests = Path(__file__).resolve().parent
    text = "".join(path.read_text("utf-8") for path in tests.rglob("test_*.py") if path.name not in own)
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
    words = ["--report", report, "--series", 1, "--normals"]
    result = run("convert", unplaced, tmp_path / "a.off", "-i", 0.5, *words)
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


COMMANDS = {
    "convert": ["convert", "{volume}", "{output}", "-i", 0.5],
    "info": ["info", "{volume}"],
    "measure": ["measure", "{mesh}", "--volume", "{volume}", "-i", 0.5],
    "batch": ["batch", "{volume}", "-i", 0.5, "-o", "{output}"],
}


@pytest.fixture
def call(unplaced, tmp_path, run):
    """Run a command of `COMMANDS` with further words; return its result and what it has written."""
    mesh = tmp_path / "mesh.ply"
    assert run("convert", unplaced, mesh, "-i", 0.5, "--spacing", "1,1,1").exit_code == 0

    def called(command, *more):
        output = tmp_path / "new" / "a.ply"
        output.parent.mkdir(exist_ok=True)
        places = {"volume": unplaced, "output": output, "mesh": mesh}
        result = run(*(str(word).format(**places) for word in COMMANDS[command]), *more)
        return result, list(output.parent.iterdir())

    return called


@pytest.mark.parametrize("command", COMMANDS)
def test_strict_ends_with_status_4_and_writes_nothing(call, command):
    result, written = call(command, "--strict")
    assert result.exit_code == (8 if command == "batch" else 4)
    if command == "batch":
        (line,) = map(json.loads, result.stdout.splitlines())
        assert (line["status"], line["vertices"]) == (4, None)
        told = line["error"]
    else:
        told = result.stderr
    assert "W-SPACING-MISSING" in told
    assert "--spacing" in told
    assert not written
    result, _ = call(command, "--strict", "--spacing", "1,1,1")
    assert result.exit_code == 0


@pytest.mark.parametrize("command", COMMANDS)
def test_strict_refuses_every_code_about_meaning_and_no_other(call, command, monkeypatch):
    read = numpy_file.numpy_volume
    told = []

    def telling(*arguments):
        return replace(read(*arguments), warnings=tuple(Notice(code, "told") for code in told))

    monkeypatch.setattr(numpy_file, "numpy_volume", telling)
    for code in ABOUT_MEANING:
        told[:] = [code]
        result, written = call(command, "--strict")
        assert (result.exit_code, written) == (8 if command == "batch" else 4, [])
        assert code in result.stderr + result.stdout
    told[:] = ABOUT_THE_RUN
    assert call(command, "--strict")[0].exit_code == 0


def test_people_see_the_codes_beside_the_sentences(call):
    for command in ("convert", "info", "measure"):
        result, _ = call(command)
        told = "tells no spacing; 1 mm is taken; --spacing gives it (W-SPACING-MISSING)"
        assert told in result.stderr + result.stdout
