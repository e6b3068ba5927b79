"""A version of Warp that is not known: launches are Warp's own, which is said, and nothing else changes."""

import json
import subprocess
import sys

import pytest
import warp as wp

from dmc_cli.runtime import compiled_kernel, worker_pool
from tests.conftest import ROOT

KNOWN_VERSIONS = compiled_kernel.KNOWN_VERSIONS
"""Those of the program itself: --any-warp adds one, once the tests run."""


@pytest.fixture
def anew(monkeypatch):
    """The process makes its pool anew, and leaves it behind."""
    monkeypatch.setattr(worker_pool, "_pool", None)


def unknown_version(monkeypatch):
    monkeypatch.setattr(compiled_kernel, "KNOWN_VERSIONS", ("1.18",))
    monkeypatch.setattr(worker_pool, "KNOWN_VERSIONS", ("1.18",))
    return f"Warp {wp.config.version} is not known, only 1.18"


def other_entry(monkeypatch):
    monkeypatch.setattr(worker_pool, "takes_structs", lambda source, kernel: False)
    return f"Warp {wp.config.version}: its compiled kernels do not take bounds and one struct"


def other_record(monkeypatch):
    def fail(board):
        raise AttributeError("no hooks")

    monkeypatch.setattr(worker_pool, "SlotKernels", fail)
    return f"Warp {wp.config.version}: its record of a launch is not as expected: no hooks"


CAUSES = [unknown_version, other_entry, other_record]


@pytest.mark.parametrize("cause", CAUSES)
def test_doctor_and_a_detailed_summary_say_why(run, anew, monkeypatch, tmp_path, cause):
    expected = f"CPU launches run on one thread ({cause(monkeypatch)})"
    told = run("doctor")
    assert told.exit_code == 0
    assert f"launches  {expected}" in told.output.splitlines()
    launches = json.loads(run("doctor", "--json").output)["launches"]
    assert launches == {"threads": 1, "fallback": expected}
    words = ["convert", "synth:torus:16", tmp_path / "torus.ply", "-i", 0, "--device", "cpu"]
    converted = run(*words, "-v")
    assert converted.exit_code == 0
    assert expected in " ".join(converted.output.split())
    assert "one thread" not in run(*words, "--force").output


def test_the_version_of_the_tests_is_known():
    assert compiled_kernel.is_known_version()


def test_known_versions_are_those_that_may_be_installed():
    bounds = [line for line in (ROOT / "pyproject.toml").read_text().splitlines() if "warp-lang>=" in line]
    lowest, highest = KNOWN_VERSIONS[0], KNOWN_VERSIONS[-1]
    after = f"1.{int(highest.split('.')[1]) + 1}"
    assert [f'"warp-lang>={lowest},<{after}"' in line for line in bounds] == [True]


@pytest.mark.pool
def test_where_the_pool_launches_nothing_is_said(run, anew, tmp_path):
    assert "CPU thread(s) share each" in run("doctor").output
    words = ["convert", "synth:torus:16", tmp_path / "torus.ply", "-i", 0, "--device", "cpu", "-v"]
    assert "one thread" not in run(*words).output


WITH_ANOTHER_WARP = """
import sys
import pytest
from dmc_cli.runtime import compiled_kernel
compiled_kernel.KNOWN_VERSIONS = ("1.18",)
sys.exit(pytest.main(sys.argv[1:]))
"""


@pytest.mark.slow
@pytest.mark.parametrize(("options", "status"), [([], 1), (["--any-warp"], 0)], ids=["as it is", "any Warp"])
def test_a_version_that_is_not_known_is_tried_where_that_is_asked_for(options, status):
    test = f"{__file__}::{test_where_the_pool_launches_nothing_is_said.__name__}"
    words = [sys.executable, "-c", WITH_ANOTHER_WARP, *options, "-q", "-p", "no:cacheprovider", test]
    result = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, timeout=200, check=False)
    assert result.returncode == status, result.stdout
    assert ("is not known, only 1.18" in result.stdout) == bool(status)
