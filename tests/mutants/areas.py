"""The areas of the package: their files, and where the tests are that are likely to notice a fault there."""

from dataclasses import dataclass

from tests.mutants.mutant import PACKAGE, ROOT


@dataclass(frozen=True)
class Area:
    """Files of the package, relative to it, and of tests, relative to the project."""

    files: tuple[str, ...]
    tests: tuple[str, ...]


AREAS = {
    "surface": Area(("surface/*.py",), ("tests/surface", "tests/test_same_bytes.py")),
    "mesh": Area(("mesh/*.py",), ("tests/mesh", "tests/test_same_bytes.py", "tests/test_needed_kernels.py")),
    "report": Area(("report/**/*.py",), ("tests/report",)),
    "volume": Area(("volume/*.py",), ("tests/volume",)),
    "writers": Area(("writers/*.py",), ("tests/writers",)),
    "cli": Area(("cli/*.py",), ("tests/cli", "tests/docs")),
    "runtime": Area(
        ("*.py", "runtime/*.py"), ("tests/test_*.py", "tests/cli", "tests/memory", "tests/runtime")
    ),
}


NO_EFFECT = ("mesh/fetch.py",)
"""Files that only ask for memory ahead of its use: no fault there shows in anything but time."""


def files_of(area, chosen=()):
    """Return the files of an area, or those of them that are named."""
    package = ROOT / PACKAGE
    found = sorted(
        path.relative_to(package).as_posix() for glob in AREAS[area].files for path in package.glob(glob)
    )
    found = [file for file in found if file not in NO_EFFECT]
    return [file for file in found if not chosen or any(file.endswith(name) for name in chosen)]


def area_of(file):
    """Return the area that a file belongs to."""
    folder = file.split("/")[0] if "/" in file else "runtime"
    return folder if folder in AREAS else "runtime"


def files_with_tests_of(area):
    """Return the test files of an area."""
    found = set()
    for name in AREAS[area].tests:
        for path in ROOT.glob(name):
            found |= {path} if path.is_file() else set(path.rglob("test_*.py"))
    return sorted(path.relative_to(ROOT).as_posix() for path in found)
