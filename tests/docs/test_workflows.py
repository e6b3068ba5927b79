"""Workflows of `.github/` and `.ci/` are well formed and call what there is."""

import re

import pytest

from tests.docs.readme import ROOT

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
CALLS = [*WORKFLOWS, ROOT / ".ci" / "run"]
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
PYPROJECT = (ROOT / "pyproject.toml").read_text("utf-8")


@pytest.mark.parametrize("path", CALLS, ids=lambda path: path.name)
def test_the_targets_that_are_called_exist(path):
    found = re.findall(r"\bmake (?:--[\w-]+ )*([a-z-]+)", re.sub(r"#.*", "", path.read_text("utf-8")))
    assert found
    assert set(found) <= TARGETS


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_is_well_formed(path):
    workflow = pytest.importorskip("yaml").safe_load(path.read_text("utf-8"))
    (schedule,) = workflow[True]["schedule"]  # YAML reads the key `on` as true
    assert len(schedule["cron"].split()) == 5
    for job in workflow["jobs"].values():
        assert all(("run" in step) != ("uses" in step) for step in job["steps"])
        for python in job["strategy"]["matrix"]["python"]:
            assert f'Programming Language :: Python :: {python}"' in PYPROJECT


def test_the_newest_of_each_package_are_ones_that_the_program_needs():
    (names,) = re.findall(r"--upgrade --no-deps (.+)", WORKFLOWS[0].read_text("utf-8"))
    for name in names.split():
        assert re.search(rf'^    "{name}[<>=]', PYPROJECT, re.MULTILINE)


def test_a_warp_that_is_not_known_is_tried(request):
    (option,) = re.findall(r"make test-all ARGS=--([\w-]+)", WORKFLOWS[0].read_text("utf-8"))
    assert request.config.getoption(f"--{option}") in (True, False)
    makefile = (ROOT / "Makefile").read_text("utf-8")
    assert re.search(r"^TESTS := .+ \$\(ARGS\)$", makefile, re.MULTILINE)
