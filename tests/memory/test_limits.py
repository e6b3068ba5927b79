"""Limits of memory are found in trees of files as the kernel shows them, of both kinds of control groups."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from dmc_cli import memory_limits
from dmc_cli.memory_limits import Available, available_memory, group_limits, total_memory

GIB = 1 << 30
NO_LIMIT = 9223372036854771712


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """A folder for /proc and control groups; call it with the groups' line and mounts, then write files."""
    monkeypatch.setattr(memory_limits, "PROC", tmp_path / "proc")
    (tmp_path / "proc/self").mkdir(parents=True)

    def make(groups, *mounts):
        (tmp_path / "proc/self/cgroup").write_text(groups)
        lines = [
            f"{30 + n} 25 0:{n} {root} {tmp_path}/{where} rw,relatime shared:9 - {kind} {kind} {options}\n"
            for n, (root, where, kind, options) in enumerate(mounts)
        ]
        (tmp_path / "proc/self/mountinfo").write_text(
            "22 1 8:1 / / rw - ext4 /dev/root rw\n" + "".join(lines)
        )
        return tmp_path

    return make


def write(folder, **files):
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / f"memory.{name}").write_text(f"{content}\n")


def sizes():
    return sorted(found.size for found in group_limits())


V2 = ("/", "cg", "cgroup2", "rw,nsdelegate")
V1 = ("/", "cg/memory", "cgroup", "rw,memory")


def test_version_2(tree):
    folder = tree("0::/job\n", V2) / "cg/job"
    write(folder, max=2 * GIB, high="max", current=GIB, stat=f"anon 5\ninactive_file {GIB // 4}\nfile 9")
    assert sizes() == [GIB + GIB // 4]
    (found,) = group_limits()
    assert found.limit == f"the memory limit of the control group {folder}"


@pytest.mark.parametrize(("high", "most"), [(GIB, 3 * GIB), (3 * GIB, GIB)])
def test_version_2_where_it_begins_to_slow_down_counts(tree, high, most):
    write(tree("0::/job\n", V2) / "cg/job", max=most, high=high, current=GIB // 2, stat="")
    assert sizes() == [GIB // 2]


def test_version_2_without_a_limit(tree):
    write(tree("0::/job\n", V2) / "cg/job", max="max", high="max", current=GIB, stat="")
    assert sizes() == []


def test_version_2_of_nested_groups_each_counts(tree):
    root = tree("0::/outer/middle/inner\n", V2) / "cg"
    write(root / "outer", max=4 * GIB, current=3 * GIB)
    write(root / "outer/middle", max="max", current=3 * GIB)
    write(root / "outer/middle/inner", max=2 * GIB, current=GIB // 2)
    assert sizes() == [GIB, GIB + GIB // 2]
    assert available_memory() == Available(GIB, f"the memory limit of the control group {root / 'outer'}")


def test_version_1_with_other_controllers(tree):
    groups = "12:cpu,cpuacct:/elsewhere\n4:hugetlb,memory:/job\n1:name=systemd:/init\n0::/\n"
    cpu = ("/", "cg/cpu", "cgroup", "rw,cpu,cpuacct")
    folder = tree(groups, cpu, V1, ("/", "cg/unified", "cgroup2", "rw")) / "cg/memory"
    write(folder, limit_in_bytes=NO_LIMIT, usage_in_bytes=7 * GIB, stat="")
    stat = f"inactive_file 1\ntotal_inactive_file {GIB}"
    write(folder / "job", limit_in_bytes=3 * GIB, usage_in_bytes=2 * GIB, stat=stat)
    write(folder.parent / "cpu/elsewhere", limit_in_bytes=1, usage_in_bytes=1)
    assert sizes() == [2 * GIB]


def test_in_a_container_the_mount_is_the_group(tree):
    """Docker with version 1 shows the path of the machine outside, and mounts its own group as the root."""
    groups = "4:memory:/docker/abc\n"
    folder = tree(groups, ("/docker/abc", "cg/memory", "cgroup", "rw,memory")) / "cg/memory"
    write(folder, limit_in_bytes=GIB, usage_in_bytes=GIB // 4)
    assert sizes() == [3 * GIB // 4]


@pytest.mark.parametrize("path", ["/gone/away", "/../../sibling"])
def test_where_the_path_is_not_mounted_the_mount_s_own_limit_counts(tree, path):
    write(tree(f"0::{path}\n", V2) / "cg", max=GIB, current=GIB // 2)
    assert sizes() == [GIB // 2]


def test_a_group_that_has_taken_more_than_its_limit_leaves_nothing(tree):
    write(tree("0::/\n", V2) / "cg", max=GIB, current=2 * GIB)
    assert sizes() == [0]


def test_more_copies_of_files_than_usage_count_as_the_usage(tree):
    write(tree("0::/\n", V2) / "cg", max=GIB, current=GIB // 2, stat=f"inactive_file {GIB}")
    assert sizes() == [GIB]


@pytest.mark.parametrize("groups", ["", "nonsense", "4:memory\n", "a:b:c:d\n"])
def test_what_makes_no_sense_limits_nothing(tree, groups):
    write(tree(groups, V2, V1) / "cg", limit_in_bytes="?", max="?", current="?", stat="inactive_file x")
    assert sizes() == []


def test_a_mount_with_a_space_in_its_name(tree, tmp_path):
    write(tree("0::/\n", ("/", "c\\040g", "cgroup2", "rw")) / "c g", max=GIB, current=0)
    assert sizes() == [GIB]


def test_without_any_of_it_the_machine_s_memory_is_what_there_is(tmp_path, monkeypatch):
    monkeypatch.setattr(memory_limits, "PROC", tmp_path)
    monkeypatch.setattr(memory_limits, "resource", None)
    assert available_memory() == Available(total_memory())


def test_where_nothing_is_told_nothing_is_known(tmp_path, monkeypatch):
    monkeypatch.setattr(memory_limits, "PROC", tmp_path)
    monkeypatch.setattr(memory_limits, "resource", None)
    monkeypatch.delattr(memory_limits.os, "sysconf")
    assert total_memory() is None
    assert available_memory() is None


@pytest.mark.parametrize(
    ("content", "expected"),
    [("MemTotal: 9 kB\nMemAvailable:   1024 kB\n", 1 << 20), ("MemAvailable: many kB\n", None), ("", None)],
)
def test_what_is_free(tmp_path, monkeypatch, content, expected):
    monkeypatch.setattr(memory_limits, "PROC", tmp_path)
    (tmp_path / "meminfo").write_text(content)
    assert available_memory() == Available(expected or total_memory())


@pytest.mark.parametrize(("name", "flag"), [("RLIMIT_AS", "-v"), ("RLIMIT_DATA", "-d")])
def test_the_shell_s_limits_count(name, flag):
    probe = (
        "import resource\nfrom dmc_cli.memory_limits import available_memory\n"
        f"resource.setrlimit(resource.{name}, (1 << 30, -1))\n"
        "found = available_memory()\nprint(0 < found.size < 1 << 30, found.limit)"
    )
    told = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True).stdout
    assert told == f"True the limit that ulimit {flag} set\n"


def test_a_limit_of_the_shell_that_is_passed_leaves_nothing(monkeypatch):
    monkeypatch.setattr(memory_limits.resource, "getrlimit", lambda _: (1 << 12, resource.RLIM_INFINITY))
    assert available_memory().size == 0


def test_a_real_control_group(tmp_path):
    """The one end-to-end proof, where this user may make a group: status 7, not the kernel's kill."""
    parent = Path("/sys/fs/cgroup/memory")
    name, files = ("memory.limit_in_bytes", "tasks") if parent.is_dir() else ("memory.max", "cgroup.procs")
    group = (parent if parent.is_dir() else parent.parent) / f"dmc-test-{os.getpid()}"
    try:
        group.mkdir()
        (group / name).write_text(str(600 << 20))
    except OSError as error:
        if group.is_dir():
            group.rmdir()
        pytest.skip(f"no control group with a memory limit can be made here: {error}")
    try:
        words = [
            sys.executable,
            "-m",
            "dmc_cli",
            "convert",
            "synth:iwp:512",
            str(tmp_path / "m.ply"),
            "-i",
            "0",
        ]
        script = f'echo $$ > {group / files} && exec "$@"'
        found = subprocess.run(
            ["sh", "-c", script, "sh", *words], capture_output=True, text=True, check=False
        )
    finally:
        group.rmdir()
    assert found.returncode == 7, found.stderr
    assert "the memory limit of the control group" in found.stderr
