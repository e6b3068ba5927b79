"""Each run of a benchmark adds a line to its history, on any system."""

import importlib
import json

import pytest

from tests.conftest import ROOT


@pytest.fixture
def history(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    module = importlib.import_module("history")
    monkeypatch.setattr(module, "RESULTS", tmp_path / "results")
    return module


def test_a_run_is_added_and_none_lost(history):
    for number in (1, 2):
        history.record("trial", {"number": number}, "Trial", f"| {number} |")
    lines = (history.RESULTS / "trial.jsonl").read_text("utf-8").splitlines()
    found = [json.loads(line) for line in lines]
    assert [line["number"] for line in found] == [1, 2]
    assert {"date", "processor", "commit", "python", "warp-lang"} <= set(found[0])
    assert "| 2 |" in (history.RESULTS / "trial.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("told", "name"), [("Apple M2", "Apple M2"), ("", "arm64")], ids=["a name", "no name"]
)
def test_a_processor_has_a_name_where_there_is_no_list_of_them(history, monkeypatch, tmp_path, told, name):
    monkeypatch.setattr(history, "CPUINFO", tmp_path / "none")
    monkeypatch.setattr("platform.processor", lambda: told)
    monkeypatch.setattr("platform.machine", lambda: "arm64")
    assert history.machine()["processor"].startswith(f"{name}, ")


@pytest.mark.parametrize(
    ("listed", "name"), [("model name\t: A 9\nmodel name\t: A 9\n", "A 9"), ("Hardware : x\n", "aarch64")]
)
def test_a_processor_has_a_name_where_there_is_a_list(history, monkeypatch, tmp_path, listed, name):
    (tmp_path / "cpuinfo").write_text(listed)
    monkeypatch.setattr(history, "CPUINFO", tmp_path / "cpuinfo")
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    assert history.processor() == name


@pytest.mark.parametrize("script", sorted(path.name for path in (ROOT / "benchmarks").glob("*.py")))
def test_what_is_measured_is_recorded(script):
    text = (ROOT / "benchmarks" / script).read_text("utf-8")
    makes = (ROOT / "Makefile").read_text("utf-8")
    lines = [line for line in makes.splitlines() if f"benchmarks/{script}" in line]
    assert all("--out " in line for line in lines)
    assert bool(lines) == ("argparse" in text)
