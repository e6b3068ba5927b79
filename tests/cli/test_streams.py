"""Standard streams that are full, gone or closed: a documented status, and no byte of text in a mesh."""

import re
import resource
import subprocess
import sys

import pytest

from dmc_cli import errors
from dmc_cli.app.batch import convert_all
from dmc_cli.settings import ConvertSettings, OutputSettings, SurfaceSettings
from tests.cli.test_errors import outcome

MESH = "convert synth:sphere:12 a.ply -i 0"
FULL = "standard output cannot be written: the disk is full"


@pytest.mark.parametrize(
    ("words", "redirected", "status", "told"),
    [
        ("--help", ">/dev/full", 9, FULL),
        ("--version", ">/dev/full", 9, FULL),
        ("convert --help", ">/dev/full", 9, FULL),
        ("completion fish", ">/dev/full", 9, FULL),
        ("info missing.nrrd", "2>/dev/full", 3, ""),
        ("convert", "2>/dev/full", 2, ""),
        (MESH, "2>/dev/full", 0, ""),
        (MESH, "<&- >&- 2>&-", 0, ""),
        ("info missing.nrrd", "2>&-", 3, ""),
        ("completion fish", ">&-", 9, "standard output cannot be written"),
        ("convert synth:sphere:12 - -i 0 --output-format ply -q", ">/dev/full", 9, FULL),
        ("convert synth:sphere:12 - -i 0 --output-format ply", ">&-", 9, "standard output cannot be written"),
    ],
)
def test_the_status_is_documented_whatever_the_streams(tmp_path, words, redirected, status, told):
    command = f"unset PYTHONUNBUFFERED; exec {sys.executable} -m dmc_cli {words} {redirected}"
    result = subprocess.run(
        ["sh", "-c", command],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        check=False,
        timeout=200,
    )
    assert result.returncode == status, result.stderr
    assert told in result.stderr
    assert not re.search("Traceback|Exception ignored", result.stderr)
    if words == MESH:
        content = (tmp_path / "a.ply").read_bytes()
        assert content.startswith(b"ply\n")
        assert b"vertices, " not in content


def test_text_without_a_buffer_that_does_not_fit_is_missed(tmp_path):
    with (tmp_path / "out").open("wb") as out:
        result = subprocess.run(
            [sys.executable, "-u", "-m", "dmc_cli", "completion", "fish"],
            stdout=out,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            check=False,
            timeout=200,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)),
        )
    assert result.returncode == 9
    assert "standard output cannot be written" in result.stderr


def test_an_error_that_is_a_bug_of_ours_keeps_its_traceback():
    result = outcome(errors.MeshInvariantError("vertex 3 is in no quad"))
    assert isinstance(result.exception, errors.MeshInvariantError)
    assert result.exit_code == 1


def test_a_bug_in_a_batch_tells_its_traceback(tmp_path, monkeypatch):
    def broken(*_, **__):
        raise errors.MeshInvariantError("vertex 3 is in no quad")

    monkeypatch.setattr("dmc_cli.app.conversion.convert", broken)
    output = OutputSettings(path=str(tmp_path / "a.ply"))
    item = ConvertSettings(input="synth:sphere:8", surface=SurfaceSettings(isovalue=0.0), output=output)
    outcomes = []
    convert_all([item], outcomes.append)
    (found,) = outcomes
    assert found.status == 1
    assert found.error.startswith("Traceback")
    assert "vertex 3 is in no quad" in found.error
