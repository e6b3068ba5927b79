"""The input is read by a thread: what it finds, and what is wrong with it, arrives all the same."""

import subprocess
import sys

import numpy as np
import pytest

from dmc_cli.app import read_ahead
from dmc_cli.app.memory_budget import reserve_cells
from dmc_cli.app.read_ahead import ReadAhead
from dmc_cli.errors import DamagedVolumeError, MemoryBudgetError, VolumeError
from dmc_cli.settings import ConvertSettings, OutputSettings, ReadSettings, SurfaceSettings
from dmc_cli.volume.volume import Volume
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.volume_file import write_volume


def settings_of(path, memory=None):
    return ConvertSettings(
        input=str(path),
        surface=SurfaceSettings(isovalue=0),
        output=OutputSettings(path="out.ply", memory=memory),
    )


@pytest.fixture
def noise(tmp_path):
    volume = read_volume("synth:noise:64", ReadSettings())
    write_volume(str(tmp_path / "noise.nii.gz"), volume)
    return tmp_path / "noise.nii.gz", volume


def test_the_volume_is_the_reader_s(noise):
    path, volume = noise
    np.testing.assert_array_equal(ReadAhead(settings_of(path)).result().values, volume.values)


def test_a_missing_input_is_told_at_once(tmp_path):
    with pytest.raises(VolumeError, match="cannot be opened"):
        ReadAhead(settings_of(tmp_path / "none.nii"))


def test_what_the_thread_fails_with_is_raised_where_the_result_is_asked_for(noise):
    path, _ = noise
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(DamagedVolumeError, match="bytes of values found"):
        ReadAhead(settings_of(path)).result()


def test_the_budget_is_held_before_any_value_is_read(noise, monkeypatch):
    path, _ = noise
    monkeypatch.setattr(np, "empty", lambda *_: pytest.fail("allocated"))
    with pytest.raises(MemoryBudgetError, match=r"need 1\.2 MiB, more than the 1\.0 MiB of --memory"):
        ReadAhead(settings_of(path, memory=1 << 20)).result()


def test_the_free_memory_is_held_against_the_values(noise, monkeypatch):
    monkeypatch.setattr("dmc_cli.app.memory_budget.available_bytes", lambda: 1 << 19)
    with pytest.raises(MemoryBudgetError, match=r"needs 1\.0 MiB, but 0\.5 MiB of memory are free"):
        ReadAhead(settings_of(noise[0])).result()
    assert isinstance(ReadAhead(settings_of(noise[0], memory=1 << 22)).result(), Volume)


def test_a_mapped_file_needs_memory_for_its_bits_only(tmp_path):
    write_volume(str(tmp_path / "noise.nii"), read_volume("synth:noise:64", ReadSettings()))
    settings = settings_of(tmp_path / "noise.nii", memory=1 << 18)
    reserve_cells(ReadAhead(settings).result(), settings)
    with pytest.raises(MemoryBudgetError, match=r"need 0\.2 MiB, more than the 0\.1 MiB"):
        reserve_cells(ReadAhead(settings).result(), settings_of(tmp_path / "noise.nii", memory=1 << 17))


def test_a_missing_input_costs_no_import_of_warp(tmp_path):
    probe = (
        "import sys\nfrom dmc_cli.cli import dmc\n"
        "try: dmc(sys.argv[1:])\nfinally: print('warp' in sys.modules)"
    )
    words = ["convert", str(tmp_path / "none.nii"), str(tmp_path / "out.ply"), "-i", "0"]
    result = subprocess.run(
        [sys.executable, "-c", probe, *words], capture_output=True, encoding="utf-8", check=False, timeout=60
    )
    assert (result.returncode, result.stdout) == (3, "False\n")
    assert result.stderr.startswith("Error: ")


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, GeneratorExit, RuntimeError])
def test_whatever_ends_the_thread_is_raised_where_the_result_is_asked_for(noise, monkeypatch, error):
    """No thread prints a traceback of its own, and nobody waits for a volume that never comes."""

    def fail(*_):
        raise error("told")

    monkeypatch.setattr(read_ahead, "read_volume", fail)
    ahead = ReadAhead(settings_of(noise[0]))
    with pytest.raises(error, match="told"):
        ahead.result()


def test_where_no_thread_can_be_made_the_caller_reads(noise, monkeypatch):
    def refuse(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(read_ahead.Thread, "start", refuse)
    path, volume = noise
    ahead = ReadAhead(settings_of(path))
    ahead.check()
    np.testing.assert_array_equal(ahead.result().values, volume.values)
