"""Find out how much memory this process may still take, in its container and its shell.

A container's limit is that of a control group, of version 1 or 2, and of every group that it lies in. What
counts against it but is only a copy of files not looked at lately is taken back before it stops anybody.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

PROC = Path("/proc")

UNLIMITED = 1 << 60
"""A limit of so many bytes is none: version 1 writes the largest number of pages for it."""


@dataclass(frozen=True, order=True)
class Available:
    """Bytes that can still be had, and what limits them; an empty text where it is the machine's memory."""

    size: int
    limit: str = ""


@dataclass(frozen=True)
class GroupFiles:
    """The files in which a version of control groups tells limits, usage and what can be taken back of it."""

    limits: tuple[str, ...]
    usage: str
    reclaimable: str


VERSIONS = {
    "cgroup": GroupFiles(("memory.limit_in_bytes",), "memory.usage_in_bytes", "total_inactive_file"),
    "cgroup2": GroupFiles(("memory.max", "memory.high"), "memory.current", "inactive_file"),
}
"""By the type of the file system that the groups are in."""


def available_memory() -> Available | None:
    """Return the least of what the system, control groups and the shell's limits leave, if one is told."""
    found = [*_free_memory(), *group_limits(), *_shell_limits()]
    return min(found) if found else None


def _free_memory() -> Iterator[Available]:
    """Yield what can be had without swapping, or all the memory there is where that is not told."""
    try:
        with (PROC / "meminfo").open(encoding="ascii") as table:
            for line in table:
                if line.startswith("MemAvailable:"):
                    yield Available(int(line.split()[1]) * 1024)
                    return
    except (OSError, ValueError, IndexError):
        pass
    if (total := total_memory()) is not None:
        yield Available(total)


def total_memory() -> int | None:
    """Return the machine's memory in bytes, or None where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None


def group_limits() -> Iterator[Available]:
    """Yield what each control group that this process is in, and that has a limit, leaves it."""
    for folder, kind in _groups(PROC):
        yield from _group_limit(folder, VERSIONS[kind])


@cache
def _groups(proc: Path) -> tuple[tuple[Path, str], ...]:
    """Return the folders of the control groups that this process is in, which it hardly ever leaves."""
    try:
        groups = (proc / "self/cgroup").read_text("utf-8", "replace").splitlines()
        mounts = (proc / "self/mountinfo").read_text("utf-8", "replace").splitlines()
    except OSError:
        return ()
    found = []
    for line in groups:
        _, controllers, path = [*line.split(":", 2), "", ""][:3]
        kind = "cgroup" if "memory" in controllers.split(",") else "cgroup2" if not controllers else ""
        for root, mount in _mounts(mounts, kind) if kind else ():
            found += [(folder, kind) for folder in _folders(mount, root, path)]
    return tuple(found)


def _mounts(lines: list[str], kind: str) -> Iterator[tuple[str, Path]]:
    """Yield the group that is at the root of each mount of a kind, and where it is mounted."""
    for line in lines:
        before, _, after = line.partition(" - ")
        fields, source = before.split(), after.split()
        if len(fields) < 5 or len(source) < 3 or source[0] != kind:
            continue
        if kind == "cgroup2" or "memory" in source[2].split(","):
            yield _unescaped(fields[3]), Path(_unescaped(fields[4]))


def _unescaped(name: str) -> str:
    """Return a path of a table of mounts, in which white space is written in octal digits."""
    for code, character in (("\\040", " "), ("\\011", "\t"), ("\\012", "\n"), ("\\134", "\\")):
        name = name.replace(code, character)
    return name


def _folders(mount: Path, root: str, path: str) -> Iterator[Path]:
    """Yield the folder of a group and of every group that it is in, as far as they are mounted.

    In a container a path may be told as the machine outside sees it; then the mount's own group is meant.
    """
    try:
        inner = Path(path).relative_to(root)
    except ValueError:
        inner = Path()
    folder = mount / inner if ".." not in inner.parts and (mount / inner).is_dir() else mount
    yield folder
    while folder != mount:
        folder = folder.parent
        yield folder


def _group_limit(folder: Path, files: GroupFiles) -> Iterator[Available]:
    """Yield what a group leaves of its limit, if it has one."""
    limits = [_number(folder / name) for name in files.limits]
    usage = _number(folder / files.usage)
    least = min((limit for limit in limits if limit is not None and limit < UNLIMITED), default=None)
    if least is not None and usage is not None:
        held = max(usage - _reclaimable(folder, files.reclaimable), 0)
        yield Available(max(least - held, 0), f"the memory limit of the control group {folder}")


def _number(path: Path) -> int | None:
    """Return the number in a file; None for `max`, and where there is no such file."""
    try:
        return int(path.read_text("ascii"))
    except (OSError, ValueError):
        return None


def _reclaimable(folder: Path, key: str) -> int:
    """Return the bytes of a group that are copies of files not looked at lately."""
    try:
        for line in (folder / "memory.stat").read_text("ascii").splitlines():
            name, _, value = line.partition(" ")
            if name == key:
                return int(value)
    except (OSError, ValueError):
        pass
    return 0


def _shell_limits() -> Iterator[Available]:
    """Yield what the limits of this process's address space and data, as `ulimit` sets them, leave."""
    if resource is None:
        return
    for name, entry in (("RLIMIT_AS", "VmSize:"), ("RLIMIT_DATA", "VmData:")):
        number = getattr(resource, name, None)
        limit = resource.RLIM_INFINITY if number is None else resource.getrlimit(number)[0]
        if limit != resource.RLIM_INFINITY:
            flag = "-v" if name == "RLIMIT_AS" else "-d"
            yield Available(max(limit - _taken(entry), 0), f"the limit that ulimit {flag} set")


def _taken(entry: str) -> int:
    """Return the bytes that an entry of this process's status tells, 0 where there is none."""
    try:
        for line in (PROC / "self/status").read_text("utf-8", "replace").splitlines():
            if line.startswith(entry):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError, IndexError):
        pass
    return 0
