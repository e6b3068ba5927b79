"""The versions that are written down are among those that pyproject.toml admits, and none is missing."""

import pytest
from packaging.requirements import Requirement

from tests.docs.readme import ROOT

tomllib = pytest.importorskip("tomllib")  # from Python 3.11 on

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
LOCKS = sorted((ROOT / "locks").glob("*.txt"))


def wanted(python):
    """The packages that development needs with a version of Python."""
    extras = PROJECT["optional-dependencies"]
    lines = [*PROJECT["dependencies"], *extras["dev"], *(line for name in extras["all"] for line in of(name))]
    needed = [Requirement(line) for line in lines if not line.startswith("dmc-cli")]
    marks = {"python_version": python, "python_full_version": f"{python}.0"}
    return [need for need in needed if need.marker is None or need.marker.evaluate(marks)]


def of(line):
    """What the extras that a line names hold."""
    return [need for name in Requirement(line).extras for need in PROJECT["optional-dependencies"][name]]


def test_every_supported_python_has_its_versions():
    told = [line for line in PROJECT["classifiers"] if "Python :: 3." in line]
    assert [f"Programming Language :: Python :: {path.stem}" for path in LOCKS] == told


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.stem)
def test_the_versions_are_admitted_and_complete(path):
    lines = path.read_text("utf-8").splitlines()
    pairs = [line.split("==") for line in lines]
    versions = {name.lower().replace("_", "-"): version for name, version in pairs}
    for need in wanted(path.stem):
        assert need.specifier.contains(versions[need.name.lower()]), need
