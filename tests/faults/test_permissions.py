"""Folders and files without permission, in a process that permission bits bind even if root starts it."""

import ctypes
import os
import shutil
import subprocess
import sys

import pytest

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.volume_file import write_volume

CAPBSET_DROP = 24
OVERRIDING = (1, 2)
"""prctl's way to give up for good what lets root pass over permission bits: CAP_DAC_OVERRIDE and
CAP_DAC_READ_SEARCH, see capabilities(7)."""


def bind_to_permissions():
    if os.geteuid() == 0:
        for capability in OVERRIDING:
            ctypes.CDLL(None).prctl(CAPBSET_DROP, capability, 0, 0, 0)


def dmc(*words, folder, **environment):
    return subprocess.run(
        [sys.executable, "-m", "dmc_cli", *words],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=200,
        preexec_fn=bind_to_permissions,
    )


def assert_failed(result, status, message):
    assert result.returncode == status, result.stderr
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.fixture
def locked(tmp_path):
    """A folder that can be read and not written."""
    folder = tmp_path / "locked"
    folder.mkdir()
    folder.chmod(0o555)
    yield folder
    folder.chmod(0o755)


@pytest.mark.parametrize("words", [["--force"], []])
def test_a_read_only_folder_is_named_before_the_work(tmp_path, locked, words):
    result = dmc("convert", "synth:torus:24", "locked/a.ply", "-i", "0", *words, folder=tmp_path)
    assert_failed(result, 9, "locked/a.ply cannot be written: no permission to write there")
    assert os.listdir(locked) == []


def test_a_report_in_a_read_only_folder_leaves_no_mesh(tmp_path, locked):
    result = dmc(
        "convert", "synth:torus:24", "a.ply", "-i", "0", "--report", "locked/a.json", folder=tmp_path
    )
    assert_failed(result, 9, "locked/a.json cannot be written: no permission to write there")
    assert os.listdir(tmp_path) == ["locked"]


def test_an_old_output_in_a_read_only_folder_stays(tmp_path, locked):
    locked.chmod(0o755)
    (locked / "a.ply").write_bytes(b"old")
    locked.chmod(0o555)
    result = dmc("convert", "synth:torus:24", "locked/a.ply", "-i", "0", "--force", folder=tmp_path)
    assert_failed(result, 9, "no permission to write there")
    assert (locked / "a.ply").read_bytes() == b"old"


@pytest.mark.parametrize("name", ["scan.nii", "scan.nii.gz", "scan.nrrd", "scan.mha"])
def test_an_input_that_may_not_be_read_is_named(tmp_path, name):
    write_volume(str(tmp_path / name), read_volume("synth:torus:8", ReadSettings()))
    (tmp_path / name).chmod(0)
    result = dmc("info", name, folder=tmp_path)
    assert_failed(result, 3, f"{name}: no permission to read it")


def test_a_folder_that_may_not_be_listed_is_named(tmp_path):
    (tmp_path / "scans").mkdir(mode=0o300)
    result = dmc("info", "scans", folder=tmp_path)
    (tmp_path / "scans").chmod(0o700)
    assert_failed(result, 3, "scans: the folder cannot be read (Permission denied)")


def test_a_kernel_cache_that_cannot_be_made_is_named(tmp_path, locked):
    result = dmc(
        "convert",
        "synth:torus:24",
        "a.ply",
        "-i",
        "0",
        folder=tmp_path,
        WARP_CACHE_PATH=str(locked / "cache"),
    )
    assert_failed(result, 9, "name another in the environment variable WARP_CACHE_PATH")
    assert os.listdir(tmp_path) == ["locked"]


def test_a_kernel_cache_that_lacks_kernels_and_cannot_be_written_is_named(tmp_path):
    import warp as wp

    cache = tmp_path / "cache" / wp.config.version
    cache.mkdir(parents=True)
    cache.chmod(0o555)
    result = dmc(
        "convert", "synth:torus:24", "a.ply", "-i", "0", folder=tmp_path, WARP_CACHE_PATH=str(cache.parent)
    )
    cache.chmod(0o755)
    assert_failed(result, 9, f"the kernel cache {cache} cannot be used: Permission denied")


def test_a_full_kernel_cache_can_only_be_read_and_is_used(tmp_path):
    """As in an image whose kernels `dmc doctor --warm-up` compiled."""
    from dmc_cli.runtime.device import initialize_warp

    initialize_warp()
    import warp as wp

    assert dmc("convert", "synth:torus:24", "a.ply", "-i", "0", folder=tmp_path).returncode == 0
    cache = tmp_path / "cache" / wp.config.version
    shutil.copytree(wp.config.kernel_cache_dir, cache)
    cache.chmod(0o555)
    words = ["convert", "synth:torus:24", "b.ply", "-i", "0"]
    result = dmc(*words, folder=tmp_path, WARP_CACHE_PATH=str(cache.parent))
    cache.chmod(0o755)
    assert result.returncode == 0, result.stderr
