"""Heaps of texts are looked at before HDF5's library follows them: a damaged one may have no end."""

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import read_volume

h5py = pytest.importorskip("h5py")


def write(path, **how):
    """A file with texts of any length in several heaps."""
    with h5py.File(path, "w", **how) as file:
        file["a"] = np.arange(60, dtype="i2").reshape(3, 4, 5)
        for n in range(300):
            file["a"].attrs[f"text{n}"] = "x" * n
    return path


@pytest.mark.parametrize("how", [{}, {"libver": "latest"}, {"userblock_size": 512}])
def test_files_with_many_heaps_are_read(tmp_path, how):
    path = write(tmp_path / "a.h5", **how)
    assert path.read_bytes().count(b"GCOL") > 3
    assert read_volume(str(path), ReadSettings()).shape == (5, 4, 3)


def test_an_item_that_leads_to_itself_is_refused(tmp_path):
    path = write(tmp_path / "a.h5")
    content = bytearray(path.read_bytes())
    at = content.index(b"GCOL") + 16
    content[at : at + 16] = bytes(16)
    path.write_bytes(content)
    with pytest.raises(DamagedVolumeError, match="a heap of texts without an end found"):
        read_volume(str(path), ReadSettings())


def test_values_that_look_like_a_heap_are_values(tmp_path):
    path = tmp_path / "a.h5"
    values = np.frombuffer(b"GCOL\x01\0\0\0" + (4096).to_bytes(8, "little") + bytes([1] * 4080), "u1")
    with h5py.File(path, "w") as file:
        file["a"] = values.reshape(16, 16, 16)
    assert read_volume(str(path), ReadSettings()).shape == (16, 16, 16)
