"""A kernel cache that is damaged, or on a full disk, in a process of its own."""

import os
import resource
import shutil
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

WORDS = ["convert", "synth:torus:24", "mesh.ply", "-i", "0", "--force"]


def convert(folder, cache, limit=resource.RLIM_INFINITY):
    return subprocess.run(
        [sys.executable, "-m", "dmc_cli", *WORDS],
        cwd=folder,
        env=os.environ | {"WARP_CACHE_PATH": str(cache)},
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=280,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY)),
    )


@pytest.fixture
def small_disk(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount") and ["mount", "-t", "tmpfs", "-o", "size=1m", "none", str(disk)]
    if not mount or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("nothing may be mounted here")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def assert_refused(result, cache, reason):
    assert result.returncode == 9, result.stderr
    assert f"Error: the kernel cache {cache}" in result.stderr
    assert f"cannot be used: {reason}" in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_disk_that_kernels_would_fill_is_told_before_they_are_compiled(tmp_path, small_disk):
    assert_refused(convert(tmp_path, small_disk), small_disk, "No space left on device")
    assert not (tmp_path / "mesh.ply").exists()
    assert [list(version.iterdir()) for version in small_disk.iterdir()] == [[]]


def test_a_limit_on_the_size_of_files_is_told_before_kernels_are_compiled(tmp_path):
    assert_refused(convert(tmp_path, tmp_path / "cache", 100_000), tmp_path / "cache", "File too large")


@pytest.mark.parametrize("suffix", [".o", ".meta"])
def test_a_damaged_module_is_compiled_anew(tmp_path, suffix):
    import warp as wp

    from dmc_cli.runtime.device import initialize_warp

    initialize_warp()
    cache = tmp_path / "cache"
    shutil.copytree(wp.config.kernel_cache_dir, cache / wp.config.version)
    assert convert(tmp_path, cache).returncode == 0
    mesh = (tmp_path / "mesh.ply").read_bytes()
    for file in (cache / wp.config.version).glob(f"wp_dmc_cli.runtime.prefix_sums*/*{suffix}"):
        file.write_bytes(file.read_bytes()[:100])
    result = convert(tmp_path, cache)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "mesh.ply").read_bytes() == mesh
