"""A hundred runs write what they have always written, byte for byte."""

import json
import platform

import pytest

from tests.same_bytes import HASHES, RUNS, make_volumes, written_by

LONG = [run for run in RUNS if "head_mr" in run and "--remesh" in run]
"""What takes ten seconds; the same options on smaller volumes stay."""

KNOWN = json.loads(HASHES.read_text("utf-8"))


@pytest.fixture(scope="module")
def volumes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("volumes")
    make_volumes(folder)
    return folder


def test_every_run_has_its_hashes():
    assert list(KNOWN) == RUNS


@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"),
    reason="the hashes are those of x86-64 with fused multiply-add",
)
@pytest.mark.parametrize(
    "command", [pytest.param(run, marks=pytest.mark.slow if run in LONG else ()) for run in RUNS]
)
def test_the_same_bytes_as_ever(run, volumes, command):
    assert written_by(run, command, volumes) == KNOWN[command]
