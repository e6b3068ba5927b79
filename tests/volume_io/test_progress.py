"""Every format reports how far reading is, forwards, to its end."""

import gzip
import json
from contextlib import contextmanager

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import values
from dmc_cli.volume_io.read import read_volume
from tests.volume_io.dicom.scanner import axial, save_stack
from tests.volume_io.nrrd.test_reader import header as nrrd_header
from tests.volume_io.reading import counting
from tests.volume_io.test_metaimage import header as meta_header

VALUES = counting((4, 3, 2))
QUARTERS = [0.25, 0.5, 0.75, 1.0]


class Listener:
    """Notes what each stage tells of itself."""

    def __init__(self):
        self.told = {"": []}
        self.inner = ""

    @contextmanager
    def stage(self, name):
        self.told[name], before, self.inner = [], self.inner, name
        yield
        self.inner = before

    def advance(self, fraction):
        self.told[self.inner].append(fraction)

    def note(self, text):
        raise AssertionError(text)


def told_of(path, **settings):
    listener = Listener()
    read_volume(str(path), ReadSettings(**settings), listener)
    return listener.told


def test_of_slices_each_is_told(tmp_path):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k}").write_bytes(plane.tobytes())
    (tmp_path / "a.nhdr").write_text(nrrd_header(extra="data file: s%d 0 3 1\n") + "\n")
    assert told_of(tmp_path / "a.nhdr") == {"": QUARTERS}


def test_of_one_file_parts_are_told(tmp_path, monkeypatch):
    monkeypatch.setattr(values, "TOLD_BYTES", 20)
    (tmp_path / "a.nrrd").write_bytes(
        nrrd_header(encoding="gzip").encode() + b"\n" + gzip.compress(VALUES.tobytes())
    )
    assert told_of(tmp_path / "a.nrrd") == {"": [20 / 48, 40 / 48, 1, 1]}


def test_of_one_file_of_several_values_a_node_parts_are_told(tmp_path, monkeypatch):
    monkeypatch.setattr(values, "NODES_AT_ONCE", 10)
    many = counting((4, 3, 2, 3))
    text = meta_header(extra="ElementNumberOfChannels = 3\n")
    (tmp_path / "a.mha").write_bytes(text.encode() + many.tobytes())
    assert told_of(tmp_path / "a.mha", volume_index=1) == {"": [10 / 24, 20 / 24, 1, 1]}
    found = read_volume(str(tmp_path / "a.mha"), ReadSettings(volume_index=1))
    np.testing.assert_array_equal(found.values, many[..., 1])
    text = meta_header(extra="ElementNumberOfChannels = 3\nCompressedData = True\n")
    (tmp_path / "a.mha").write_bytes(text.encode() + gzip.compress(many.tobytes()[:-1]))
    with pytest.raises(DamagedVolumeError, match="143 bytes of values found, 144 expected"):
        told_of(tmp_path / "a.mha", volume_index=1)


def test_of_slices_with_several_values_a_node_each_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(values, "NODES_AT_ONCE", 4)
    many = counting((4, 3, 2, 3))
    for k, plane in enumerate(many):
        (tmp_path / f"s{k}").write_bytes(plane.tobytes())
    text = meta_header("s%d 0 3 1", extra="ElementNumberOfChannels = 3\n")
    (tmp_path / "a.mhd").write_text(text)
    assert told_of(tmp_path / "a.mhd", volume_index=2) == {"": QUARTERS}


def test_of_a_series_files_and_slices_are_told(tmp_path):
    save_stack(tmp_path, axial())
    assert told_of(tmp_path) == {"": [], "scanning": QUARTERS, "reading slices": QUARTERS}


def test_of_an_array_its_end_is_told(tmp_path):
    np.save(tmp_path / "a.npy", VALUES)
    assert told_of(tmp_path / "a.npy") == {"": [1.0]}


def test_of_a_folder_of_tiffs_each_is_told(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    for k, plane in enumerate(VALUES):
        tifffile.imwrite(tmp_path / f"{k}.tif", plane)
    assert told_of(tmp_path) == {"": QUARTERS}


def test_of_a_store_each_chunk_is_told(tmp_path):
    pytest.importorskip("numcodecs")
    told = {"zarr_format": 2, "shape": [4, 3, 2], "chunks": [1, 3, 2], "dtype": "<i2", "fill_value": 0}
    told |= {"compressor": None, "order": "C", "filters": None}
    (tmp_path / "a.zarr").mkdir()
    (tmp_path / "a.zarr/.zarray").write_text(json.dumps(told))
    for k, plane in enumerate(VALUES):
        (tmp_path / f"a.zarr/{k}.0.0").write_bytes(plane.tobytes())
    assert told_of(tmp_path / "a.zarr") == {"": QUARTERS}


def test_of_a_field_each_slab_is_told(monkeypatch):
    monkeypatch.setattr("dmc_cli.volume_io.synthetic.SLAB_NODES", 16)
    assert told_of("synth:sphere:4") == {"": QUARTERS}
