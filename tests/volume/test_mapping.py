"""A file that shrinks while it is mapped ends in one message, whoever looks at it."""

import errno
import gc
import os
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.contouring import compute_normals, extract_surface
from dmc_cli.errors import DamagedVolumeError
from dmc_cli.field import upload_volume
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import ReadSettings, SurfaceSettings
from dmc_cli.volume import mapping as mapping_module
from dmc_cli.volume.mapping import MappedFile, intact, map_file, mapped_file
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.volume_file import write_volume

TOLD = "became shorter, or could not be read, while it was in use"
PAGE = 4096
NODES = 48


@pytest.fixture(params=[".nii", ".npy"])
def scan(request, tmp_path):
    """Return a file that is mapped, some hundred pages of it."""
    path = tmp_path / f"scan{request.param}"
    volume = read_volume(f"synth:noise:{NODES}", ReadSettings())
    if request.param == ".npy":
        np.save(path, volume.values)
    else:
        write_volume(str(path), volume)
    return path


def read(path):
    volume = read_volume(str(path), ReadSettings())
    assert mapped_file(volume.values) is not None
    return volume


def surface_of(volume, threads=2):
    uploaded = upload_volume(volume, select_device("cpu", threads))
    return extract_surface(uploaded, SurfaceSettings(isovalue=0.0))


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("left", [0, PAGE, 40 * PAGE + 17, -1])
def test_kernels_go_on_and_the_loss_is_told(scan, left, threads):
    volume = read(scan)
    size = scan.stat().st_size
    os.truncate(scan, left if left >= 0 else size + left)
    with pytest.raises(DamagedVolumeError, match=TOLD) as caught:
        surface_of(volume, threads)
    assert str(scan) in str(caught.value)


def test_a_file_that_grows_is_as_good_as_one_that_stays(scan):
    expected = surface_of(read(scan)).mesh.positions.numpy().copy()
    volume = read(scan)
    with scan.open("ab") as file:
        file.write(bytes(10 * PAGE))
    np.testing.assert_array_equal(surface_of(volume).mesh.positions.numpy(), expected)


def test_a_file_that_is_replaced_by_another_is_read_to_its_end(scan):
    expected = surface_of(read(scan)).mesh.positions.numpy().copy()
    volume = read(scan)
    scan.with_name("new").write_bytes(b"short")
    scan.with_name("new").replace(scan)
    np.testing.assert_array_equal(surface_of(volume).mesh.positions.numpy(), expected)


def test_a_loss_of_one_file_is_no_others(scan, tmp_path):
    other = tmp_path / f"other{scan.suffix}"
    other.write_bytes(scan.read_bytes())
    lost, kept = read(scan), read(other)
    os.truncate(scan, PAGE)
    with pytest.raises(DamagedVolumeError):
        surface_of(lost)
    assert surface_of(kept).mesh.face_count > 0


def test_normals_of_what_is_lost_do_not_stop_the_process(scan):
    volume = read(scan)
    surface = surface_of(volume)
    os.truncate(scan, PAGE)
    with pytest.raises(DamagedVolumeError, match=TOLD), intact(volume.values, str(scan)):
        compute_normals(surface.placement, SurfaceSettings(isovalue=0.0))


def test_numpy_goes_on_and_the_rest_of_the_mapping_is_zeros(scan):
    volume = read(scan)
    os.truncate(scan, 10 * PAGE)
    mapping = mapped_file(volume.values)
    assert not mapping.has_holes
    with pytest.raises(DamagedVolumeError, match=TOLD), intact(volume.values, str(scan)):
        assert volume.values.sum() == volume.values.reshape(-1)[: 10 * PAGE // 4].sum()
    assert mapping.has_holes
    assert bytes(mapping[10 * PAGE :]) == bytes(len(mapping) - 10 * PAGE)
    assert bytes(mapping[: 10 * PAGE]) == scan.read_bytes()


def test_zeros_begin_with_the_page_that_is_gone(scan):
    """Nothing before it, which other threads read, and everything after it at once."""
    mapping = mapped_file(read(scan).values)
    before = scan.read_bytes()
    os.truncate(scan, 5 * PAGE)
    assert mapping[7 * PAGE + 1] == 0
    os.truncate(scan, len(before))
    with scan.open("r+b") as file:
        file.write(before)
    assert mapping[: 7 * PAGE] == before[: 7 * PAGE]
    assert mapping[7 * PAGE :] == bytes(len(mapping) - 7 * PAGE)
    assert mapping.is_lost


def test_whatever_goes_wrong_with_what_is_lost_is_the_loss(scan):
    volume = read(scan)
    os.truncate(scan, PAGE)
    with pytest.raises(DamagedVolumeError, match=TOLD) as caught, intact(volume.values, "scan"):
        raise ZeroDivisionError
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    with pytest.raises(KeyboardInterrupt), intact(volume.values, "scan"):
        raise KeyboardInterrupt


def test_what_goes_wrong_with_what_is_there_is_told_as_it_is(scan):
    volume = read(scan)
    with pytest.raises(ZeroDivisionError), intact(volume.values, "scan"):
        raise ZeroDivisionError
    with pytest.raises(ZeroDivisionError), intact(np.zeros(3), "no file"):
        raise ZeroDivisionError
    with intact(np.zeros(3), "no file"):
        pass


@pytest.mark.parametrize("dtype", [">f4", "f2"])
def test_a_file_that_shrinks_while_it_is_copied(tmp_path, dtype, monkeypatch):
    path = tmp_path / "scan.npy"
    np.save(path, np.ones((20, 20, 20), dtype))

    def shrunk(file):
        mapping = map_file(file)
        os.truncate(path, PAGE)
        return mapping

    monkeypatch.setattr("dmc_cli.volume_io.numpy_file.map_file", shrunk)
    with pytest.raises(DamagedVolumeError, match=TOLD):
        read_volume(str(path), ReadSettings())


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("axes", [3, 4])
def test_an_array_that_cannot_be_mapped_is_read(tmp_path, order, axes, monkeypatch):
    values = np.asarray(np.random.default_rng(1).random((2, 5, 6, 7)[4 - axes :]), np.float32, order=order)
    np.save(tmp_path / "a.npy", values)
    settings = replace(ReadSettings(), volume_index=1 if axes == 4 else None)
    mapped = read_volume(str(tmp_path / "a.npy"), settings).values
    monkeypatch.setattr("dmc_cli.volume_io.numpy_file.map_file", lambda file: None)
    found = read_volume(str(tmp_path / "a.npy"), settings).values
    assert mapped_file(found) is None
    np.testing.assert_array_equal(found, values[1] if axes == 4 else values)
    np.testing.assert_array_equal(found, mapped)


def test_what_cannot_be_mapped_gives_none(tmp_path, monkeypatch):
    (tmp_path / "empty").touch()
    with (tmp_path / "empty").open("rb") as file:
        assert map_file(file) is None

    def no_memory(*words, **options):
        raise OSError(errno.ENOMEM, "Cannot allocate memory")

    monkeypatch.setattr(mapping_module, "MappedFile", no_memory)
    (tmp_path / "full").write_bytes(b"x")
    with (tmp_path / "full").open("rb") as file:
        assert map_file(file) is None


def test_mappings_that_are_gone_are_forgotten(scan):
    gc.collect()
    known = mapping_module._WATCH._mappings
    before = len(known)
    volumes = [read(scan) for _ in range(3)]
    assert len(known) == before + 3
    del volumes
    gc.collect()
    assert len(known) == before


def test_elsewhere_nothing_handles_the_signal(scan, monkeypatch):
    monkeypatch.setattr(mapping_module, "_KNOWS_HANDLERS", False)
    known = dict(mapping_module._WATCH._mappings)
    with scan.open("rb") as file:
        mapping = map_file(file)
    assert mapping_module._WATCH._mappings == known
    os.truncate(scan, len(mapping) - 1)
    assert mapping.is_lost


OTHERS = """
import faulthandler, mmap, os, signal, sys
{before}
from dmc_cli.volume.mapping import map_file
with open(sys.argv[1], "rb") as file:
    ours = map_file(file)
with open(sys.argv[1], "rb") as file:
    theirs = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
os.truncate(sys.argv[1], 4096)
print(ours[50000], ours.has_holes, flush=True)
theirs[50000]
"""


@pytest.mark.parametrize("before", ["", "faulthandler.enable()"], ids=["nobody", "faulthandler"])
def test_another_mapping_has_the_effect_that_it_had_before(tmp_path, before):
    path = tmp_path / "file"
    path.write_bytes(b"x" * 100_000)
    run = subprocess.run(
        [sys.executable, "-c", OTHERS.format(before=before), str(path)],
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=60,
    )
    assert run.stdout == "0 True\n"
    assert run.returncode == -signal.SIGBUS
    assert ("Bus error" in run.stderr) == bool(before)


COMMAND = """
import os
from dmc_cli.volume import mapping
from dmc_cli.volume_io import values
known = mapping.map_file

def shrunk(file):
    mapped = known(file)
    os.truncate("scan.nii", 8192)
    return mapped

values.map_file = shrunk
from dmc_cli.cli import main
main()
"""


@pytest.mark.parametrize(
    "words", [["convert", "scan.nii", "mesh.ply", "-i", "0", "--report", "r.json"], ["info", "scan.nii"]]
)
def test_a_command_ends_with_one_message_and_without_an_output(tmp_path, words):
    write_volume(str(tmp_path / "scan.nii"), read_volume(f"synth:noise:{NODES}", ReadSettings()))
    run = subprocess.run(
        [sys.executable, "-c", COMMAND, *words],
        cwd=tmp_path,
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=200,
    )
    assert run.returncode == 3, run.stderr
    assert run.stderr.startswith("Error: scan.nii: the file became shorter")
    assert run.stderr.count("\n") == 1
    assert run.stdout == ""
    assert os.listdir(tmp_path) == ["scan.nii"]


def test_measures_of_what_is_lost_are_none(tmp_path, run, monkeypatch):
    path, mesh = tmp_path / "scan.nii", tmp_path / "mesh.ply"
    write_volume(str(path), read_volume(f"synth:noise:{NODES}", ReadSettings()))
    assert run("convert", path, mesh, "-i", 0).exit_code == 0

    def shrunk(file):
        mapping = map_file(file)
        os.truncate(path, PAGE)
        return mapping

    monkeypatch.setattr("dmc_cli.volume_io.values.map_file", shrunk)
    result = run("measure", mesh, "--volume", path, "-i", 0)
    assert result.exit_code == 3
    assert TOLD in result.stderr


def test_a_mapping_is_a_mapping_of_pythons(scan):
    mapping = mapped_file(read(scan).values)
    assert isinstance(mapping, MappedFile)
    assert not mapping.is_lost
    assert bytes(mapping) == scan.read_bytes()
    assert mapped_file(np.zeros(3)) is None
    assert mapped_file(np.frombuffer(b"1234", np.uint8)) is None
