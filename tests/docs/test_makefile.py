"""`make` finds a Python that is new enough, or says what is missing; what is supported is told the same."""

import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.conftest import ROOT
from tests.docs.readme import README

needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")


def make(*words, **variables):
    assigned = [f"{name}={value}" for name, value in variables.items()]
    command = [shutil.which("make"), "--no-print-directory", "-C", str(ROOT), *words, *assigned]
    outer = (
        "MAKEFLAGS",
        "MFLAGS",
        "MAKEOVERRIDES",
        "LOCKED",
        "VENV",
        "PYTHON",
    )  # of the make that runs the tests
    environment = {name: value for name, value in os.environ.items() if name not in outer}
    return subprocess.run(
        command, env=environment, capture_output=True, encoding="utf-8", check=False, timeout=60
    )


@needs_make
def test_a_python_that_is_none_is_named(tmp_path):
    result = make("setup", PYTHON=tmp_path / "none", VENV=tmp_path / "venv")
    assert result.returncode == 2
    assert f"{tmp_path / 'none'} is no Python 3.10 or later with venv; install one" in result.stderr
    assert not (tmp_path / "venv").exists()


@needs_make
@pytest.mark.parametrize("version", ["(3, 9, 18)", "(3, 12, 99)", "none"])
def test_an_environment_of_another_python_is_made_anew(tmp_path, version):
    """A stand-in answers for the environment's own Python; `make -n` tells what would be done."""
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.write_text(f"#!/bin/sh\necho '{version}'\n")
    python.chmod(0o755)
    (tmp_path / ".installed-dev").touch()
    assert "-m venv --clear" in make("-n", "setup", PYTHON=sys.executable, VENV=tmp_path).stdout
    kept = str(tuple(sys.version_info[:3]))
    python.write_text(f"#!/bin/sh\necho '{kept}'\n")
    assert "venv --clear" not in make("-n", "setup", PYTHON=sys.executable, VENV=tmp_path).stdout
    assert "venv --clear" not in make("-n", "setup", VENV=tmp_path).stdout


@needs_make
def test_what_was_installed_without_the_lock_is_installed_with_it_when_that_is_asked_for(tmp_path):
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.write_text("#!/bin/sh\necho 3.12\n")
    python.chmod(0o755)
    (tmp_path / ".installed-dev").touch()
    assert "pip install" not in make("-n", "setup", VENV=tmp_path).stdout
    assert "--constraint locks/" in make("-n", "setup", VENV=tmp_path, LOCKED=1).stdout
    for stamp in (".locked", ".installed-dev"):  # in the order in which they are made
        (tmp_path / stamp).touch()
    assert "pip install" not in make("-n", "setup", VENV=tmp_path, LOCKED=1).stdout
    (tmp_path / ".installed-dev").unlink()
    assert f"rm -f {tmp_path}/.locked" in make("-n", "setup", VENV=tmp_path).stdout


def test_the_supported_versions_are_told_the_same_everywhere():
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    versions = re.findall(r'"Programming Language :: Python :: (3\.\d+)"', text)
    least = re.search(r'requires-python = ">=(3\.\d+)"', text)[1]
    assert versions == ["3.10", "3.11", "3.12", "3.13"]
    assert least == versions[0]
    assert f"Python {versions[0]} to {versions[-1]}" in README.read_text("utf-8")


@needs_make
def test_tests_keep_compiled_python_where_the_shell_forbids_it(tmp_path, monkeypatch):
    """A stand-in for the environment's Python tells what it is given; an empty variable forbids nothing."""
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.write_text('#!/bin/sh\necho "forbidden: <$PYTHONDONTWRITEBYTECODE>"\n')
    python.chmod(0o755)
    (tmp_path / ".installed-dev").touch()
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    assert "forbidden: <>" in make("test", VENV=tmp_path).stdout
