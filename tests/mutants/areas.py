"""The areas of the package: their files, and where the tests are that are likely to notice a fault there."""

from dataclasses import dataclass

from tests.mutants.mutant import PACKAGE, ROOT


@dataclass(frozen=True)
class Area:
    """Files of the package, relative to it, and of tests, relative to the project."""

    files: tuple[str, ...]
    tests: tuple[str, ...]


AREAS = {
    "contouring": Area(
        ("bits/*.py", "field/*.py", "contouring/**/*.py"),
        (
            "tests/bits",
            "tests/field",
            "tests/contouring",
            "tests/test_same_bytes.py",
            "tests/runtime/test_other_hardware.py",
        ),
    ),
    "processing": Area(
        ("mesh/*.py", "processing/**/*.py"),
        ("tests/mesh", "tests/processing", "tests/test_same_bytes.py", "tests/app/test_needed_kernels.py"),
    ),
    "report": Area(
        ("measures/*.py", "report/*.py", "reproduction/*.py", "figures/*.py"),
        ("tests/measures", "tests/report", "tests/reproduction", "tests/app"),
    ),
    "parts": Area(("parts/*.py",), ("tests/parts", "tests/memory")),
    "volume": Area(("volume/*.py", "volume_io/**/*.py"), ("tests/volume", "tests/volume_io")),
    "mesh_io": Area(("mesh_io/**/*.py", "files/*.py"), ("tests/mesh_io", "tests/files")),
    "cli": Area(("cli/**/*.py",), ("tests/cli", "tests/docs")),
    "runtime": Area(
        ("*.py", "settings/*.py", "app/*.py", "runtime/*.py"),
        ("tests/test_*.py", "tests/settings", "tests/app", "tests/cli", "tests/memory", "tests/runtime"),
    ),
}


NO_EFFECT = ("field/prefetch.py", "field/prefetch.h")
"""Files that only ask for memory ahead of its use: no fault there shows in anything but time."""


def files_of(area, chosen=()):
    """Return the files of an area, modules and the headers beside them, or those of them that are named."""
    package = ROOT / PACKAGE
    globs = [glob.removesuffix("py") + suffix for glob in AREAS[area].files for suffix in ("py", "h")]
    found = sorted(path.relative_to(package).as_posix() for glob in globs for path in package.glob(glob))
    found = [file for file in found if file not in NO_EFFECT]
    return [file for file in found if not chosen or any(file.endswith(name) for name in chosen)]


def area_of(file):
    """Return the area that a file belongs to."""
    folder = file.split("/")[0] if "/" in file else "*.py"
    return next(name for name, area in AREAS.items() if folder in {glob.split("/")[0] for glob in area.files})


def files_with_tests_of(area):
    """Return the test files of an area."""
    found = set()
    for name in AREAS[area].tests:
        for path in ROOT.glob(name):
            found |= {path} if path.is_file() else set(path.rglob("test_*.py"))
    return sorted(path.relative_to(ROOT).as_posix() for path in found)
