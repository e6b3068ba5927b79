"""Full disks, size limits and inputs that shrink, in a process of its own."""

import os
import resource
import subprocess
import sys

import pytest

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.volume_file import write_volume

pytestmark = pytest.mark.slow


def convert(*words, folder, limit=None):
    def limit_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    return subprocess.run(
        [sys.executable, "-m", "dmc_cli", "convert", *words],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=200,
        preexec_fn=limit_files if limit is not None else None,
    )


@pytest.mark.parametrize("limit", [0, 1, 4095, 65536, 1_000_000])
@pytest.mark.parametrize("name", ["mesh.ply", "mesh.obj", "mesh.off"])
def test_a_limit_on_the_size_leaves_the_old_output(tmp_path, name, limit):
    (tmp_path / name).write_bytes(b"old")
    result = convert("synth:iwp:64", name, "-i", "0", "--force", folder=tmp_path, limit=limit)
    assert result.returncode == 9
    assert f"{name} cannot be written" in result.stderr
    assert "Traceback" not in result.stderr
    assert (tmp_path / name).read_bytes() == b"old"
    assert os.listdir(tmp_path) == [name]


def test_a_full_disk_under_the_report(tmp_path):
    result = convert("synth:torus:24", "mesh.ply", "-i", "0", "--report", "/dev/full", folder=tmp_path)
    assert result.returncode == 9
    assert "/dev/full cannot be written: the disk is full" in result.stderr


def test_a_full_disk_under_standard_output(tmp_path):
    with open("/dev/full", "w") as full:
        result = subprocess.run(
            [sys.executable, "-m", "dmc_cli", "info", "synth:torus:24"],
            stdout=full,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            check=False,
            timeout=60,
        )
    assert result.returncode == 9
    assert result.stderr.startswith("Error: standard output cannot be written: the disk is full")


def test_a_reader_that_goes_away(tmp_path):
    command = [
        sys.executable,
        "-m",
        "dmc_cli",
        "convert",
        "synth:iwp:64",
        "-",
        "-i",
        "0",
        "--output-format",
        "obj",
    ]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        run.stdout.read(100)
        run.stdout.close()
        message = run.stderr.read().decode()
        assert run.wait(60) == 9
    assert "standard output cannot be written: the reader of the output is gone" in message
    assert "Exception ignored" not in message


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_an_input_that_shrank_ends_with_status_3(tmp_path, suffix):
    path = tmp_path / f"scan{suffix}"
    write_volume(str(path), read_volume("synth:noise:32", ReadSettings()))
    os.truncate(path, path.stat().st_size // 2)
    result = convert(path.name, "mesh.ply", "-i", "0", folder=tmp_path)
    assert result.returncode == 3
    assert os.listdir(tmp_path) == [path.name]


SHRINK = """
import os, sys, time
from dmc_cli.app import conversion
from dmc_cli.app.read_ahead import ReadAhead
from dmc_cli.settings import ConvertSettings, OutputSettings, SurfaceSettings
settings = ConvertSettings(
    input="scan.nii", surface=SurfaceSettings(isovalue=0), output=OutputSettings(path="mesh.ply")
)
ahead = ReadAhead(settings)
time.sleep(1)  # the file is mapped by then
os.truncate("scan.nii", 4096)
conversion.convert(settings, ahead=ahead)
"""


def test_a_mapped_input_that_shrinks_ends_with_one_error(tmp_path):
    write_volume(str(tmp_path / "scan.nii"), read_volume("synth:noise:32", ReadSettings()))
    result = subprocess.run(
        [sys.executable, "-c", SHRINK],
        cwd=tmp_path,
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=200,
    )
    assert "DamagedVolumeError: scan.nii: the file became shorter" in result.stderr
    assert result.returncode == 1  # of a script that catches nothing
    assert os.listdir(tmp_path) == ["scan.nii"]
