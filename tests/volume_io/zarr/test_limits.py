"""A Zarr store that promises more than it may is refused, and so is what else is wrong with one."""

import json

import numpy as np
import pytest

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from dmc_cli.volume_io.zarr import chunks as zarr_chunks, codecs as zarr_codecs, metadata as zarr_metadata
from tests.volume_io.reading import counting, read

pytest.importorskip("numcodecs")

VALUES = counting((6, 7, 9), "<i2")
OLD = {"zarr_format": 2, "shape": [6, 7, 9], "chunks": [3, 7, 9], "dtype": "<i2", "fill_value": 5}
OLD |= {"compressor": None, "order": "C", "filters": None}
NEW = {
    "zarr_format": 3,
    "node_type": "array",
    "shape": [6, 7, 9],
    "data_type": "int16",
    "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [6, 7, 9]}},
    "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
    "fill_value": 0,
    "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
}


def old(folder, count=2, **changes):
    folder.mkdir(parents=True)
    (folder / ".zarray").write_text(json.dumps(OLD | changes))
    for k in range(count):
        (folder / f"{k}.0.0").write_bytes(VALUES[3 * k : 3 * k + 3].tobytes())
    return folder


def new(folder, content=None, **changes):
    (folder / "c/0/0").mkdir(parents=True)
    (folder / "zarr.json").write_text(json.dumps(NEW | changes))
    (folder / "c/0/0/0").write_bytes(VALUES.tobytes() if content is None else content)
    return folder


def test_both_versions_by_hand(tmp_path):
    np.testing.assert_array_equal(read(old(tmp_path / "old.zarr")).values, VALUES)
    np.testing.assert_array_equal(read(new(tmp_path / "new.zarr")).values, VALUES)


def test_the_newer_metadata_count_where_there_are_both(tmp_path):
    path = new(tmp_path / "a.zarr")
    (path / ".zarray").write_text(json.dumps(OLD | {"filters": [{"id": "pickle"}]}))
    np.testing.assert_array_equal(read(path).values, VALUES)


CODECS = [{"name": "bytes", "configuration": {"endian": "little"}}]


def sharded(chunk, **changes):
    told = {"chunk_shape": chunk, "codecs": CODECS, "index_codecs": [*CODECS, {"name": "crc32c"}], **changes}
    return [{"name": "sharding_indexed", "configuration": told}]


@pytest.mark.parametrize(
    "changes",
    [
        {"zarr_format": 2},
        {"node_type": "thing"},
        {"codecs": []},
        {"codecs": [*CODECS, *CODECS]},
        {"codecs": [{"name": "bytes", "configuration": {"endian": "middle"}}]},
        {
            "codecs": [
                {"name": "numcodecs.delta", "configuration": {"dtype": "<i2"}},
                {"name": "bytes", "configuration": {"endian": "big"}},
            ]
        },
        {"codecs": [{"name": "transpose", "configuration": {"order": [0, 1]}}, *CODECS]},
        {"codecs": [{"name": "transpose", "configuration": {"order": [0, 1, 1]}}, *CODECS]},
        {"codecs": [*CODECS, {"name": "transpose", "configuration": {"order": [0, 1, 2]}}]},
        {"codecs": [{"name": "vlen-utf8"}]},
        {"codecs": sharded([4, 7, 9])},
        {"codecs": sharded([6, 7])},
        {"codecs": sharded([6, 7, 9], index_location="middle")},
        {"codecs": sharded([6, 7, 9], index_codecs=[{"name": "bytes", "configuration": {"endian": "x"}}])},
        {"codecs": sharded([6, 7, 9], codecs=[{"name": "pickle"}])},
        {"chunk_key_encoding": {"name": "default", "configuration": {"separator": ":"}}},
        {"chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [6, 7]}}},
        {"fill_value": "0x10"},
        {"shape": [1] * 30 + [6, 7, 9]},
    ],
    ids=lambda changes: str(changes)[:60],
)
def test_metadata_of_version_3_that_cannot_be_meant(tmp_path, changes):
    with pytest.raises(DamagedVolumeError):
        read(new(tmp_path / "a.zarr", **changes))


@pytest.mark.parametrize("index", [["bytes"], ["bytes", "crc32c"], ["gzip"], ["bytes", "gzip"]])
def test_indices_of_shards(tmp_path, index):
    import google_crc32c

    table = np.array([0, VALUES.nbytes], "<u8").tobytes()
    check = google_crc32c.value(table).to_bytes(4, "little") if index[-1] == "crc32c" else b""
    codecs = sharded([6, 7, 9], index_codecs=[{"name": name} for name in index])
    path = new(tmp_path / "a.zarr", VALUES.tobytes() + table + check, codecs=codecs)
    if "gzip" in index:
        with pytest.raises(UnsupportedFormatError, match=r"an index of codecs .*expected bytes and crc32c"):
            read(path)
        return
    np.testing.assert_array_equal(read(path).values, VALUES)


@pytest.mark.parametrize("order", ["C", "F", [2, 1, 0]])
def test_orders_of_a_transpose(tmp_path, order):
    codecs = [{"name": "transpose", "configuration": {"order": order}}, *CODECS]
    content = (VALUES if order == "C" else VALUES.T).tobytes()
    np.testing.assert_array_equal(read(new(tmp_path / "a.zarr", content, codecs=codecs)).values, VALUES)


@pytest.mark.parametrize("codecs", [["bytes"], ["bytes", {"name": "numcodecs.zlib"}]])
def test_codecs_may_be_names_alone(tmp_path, codecs):
    import zlib

    content = VALUES.tobytes() if len(codecs) == 1 else zlib.compress(VALUES.tobytes())
    np.testing.assert_array_equal(read(new(tmp_path / "a.zarr", content, codecs=codecs)).values, VALUES)


@pytest.mark.parametrize(
    "stray", ["0.0", "0.0.0.0", "00.0.0", "2.0.0", "0.0.1", "-1.0.0", "0.0.x", "c.0.0.0", ".hidden", "１.0.0"]
)
def test_other_files_are_no_chunks(tmp_path, stray):
    path = old(tmp_path / "a.zarr")
    (path / stray).write_bytes(b"nothing")
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_chunks_that_are_not_there_hold_the_fill_value(tmp_path):
    values = VALUES.copy()
    values[3:] = 5
    np.testing.assert_array_equal(read(old(tmp_path / "a.zarr", count=1)).values, values)


def test_the_files_that_an_array_needs(tmp_path, monkeypatch):
    monkeypatch.setattr(zarr_chunks, "LEAST_FILES", 1)
    np.testing.assert_array_equal(read(old(tmp_path / "a.zarr", count=1)).values[:3], VALUES[:3])
    with pytest.raises(
        DamagedVolumeError, match=r"0 bytes in 0 chunk file\(s\) found for an array of \(6, 7, 9\) in 2"
    ):
        read(old(tmp_path / "b.zarr", count=0))


@pytest.mark.parametrize("shape", [[2**39, 2**39, 6, 7, 9], [0, 6, 7, 9]])
def test_more_volumes_than_numbers_and_none_at_all(tmp_path, shape):
    path = old(tmp_path / "a.zarr", shape=shape, chunks=[1] * (len(shape) - 3) + [6, 7, 9])
    with pytest.raises(VolumeError, match=r"the store is incomplete|: 0 volumes found; expected one or some"):
        read(path, volume_index=0)


def test_a_filter_that_divides_by_zero_is_refused(tmp_path):
    """Its array would be NaN and infinity, which count as no data."""
    scaled = [{"id": "fixedscaleoffset", "scale": 0, "offset": 0, "dtype": "<f4", "astype": "<i2"}]
    with pytest.raises(DamagedVolumeError, match=r"cannot be read \(divide by zero"):
        read(old(tmp_path / "a.zarr", dtype="<f4", filters=scaled))


def test_the_bytes_that_an_array_needs(tmp_path, monkeypatch):
    monkeypatch.setattr(zarr_chunks, "SLACK", 0)
    monkeypatch.setattr(zarr_chunks, "LARGEST_RATIO", 2)
    assert read(old(tmp_path / "a.zarr", count=1)).shape == (9, 7, 6)
    monkeypatch.setattr(zarr_chunks, "LARGEST_RATIO", 1.99)
    with pytest.raises(DamagedVolumeError, match="the store is incomplete"):
        read(tmp_path / "a.zarr")


def test_the_largest_chunk_of_an_array(tmp_path, monkeypatch):
    monkeypatch.setattr(zarr_chunks, "SLACK", 0)
    big = np.zeros((12, 7, 9), "<i2")
    big[:6] = VALUES
    path = old(tmp_path / "a.zarr", count=0)
    (path / ".zarray").write_text(json.dumps(OLD | {"chunks": [12, 7, 9]}))
    (path / "0.0.0").write_bytes(big.tobytes())
    for limit, taken in ((2, True), (1.99, False)):
        monkeypatch.setattr(zarr_chunks, "LARGEST_CHUNK", limit)
        if taken:
            np.testing.assert_array_equal(read(path).values, VALUES)
            continue
        with pytest.raises(DamagedVolumeError, match="metadata are damaged"):
            read(path)


@pytest.mark.parametrize(
    ("changes", "taken"),
    [
        ({"shape": [1000, 2, 2], "chunks": [1, 2, 2]}, True),
        ({"shape": [1001, 2, 2], "chunks": [1, 2, 2]}, False),
        ({"shape": [2, 2, 2], "chunks": [64 * 8 + (1 << 26), 1, 1]}, True),
        ({"shape": [2, 2, 2], "chunks": [64 * 8 + (1 << 26) + 1, 1, 1]}, False),
        ({"shape": [2, 2, 1 << 24], "chunks": [2, 2, 1 << 24]}, True),
        ({"shape": [2, 2, (1 << 24) + 1], "chunks": [2, 2, 1 << 24]}, False),
        ({"shape": [1] * 29 + [2, 2, 2], "chunks": [1] * 29 + [2, 2, 2]}, True),
        ({"shape": [1] * 30 + [2, 2, 2], "chunks": [1] * 30 + [2, 2, 2]}, False),
        ({"shape": [2, 2, 2**40], "chunks": [2, 2, 2]}, False),
    ],
    ids=str,
)
def test_arrays_of_nothing_but_the_fill_value(tmp_path, changes, taken):
    """As large as an array may be of which no chunk is stored, and one more."""
    path = old(tmp_path / "a.zarr", count=0, dtype="|u1", **changes)
    if taken:
        found = read(path).values
        assert found.shape == tuple(changes["shape"][-3:])
        assert found[0, 0, 0] == found[-1, -1, -1] == 5
        return
    with pytest.raises(DamagedVolumeError, match=r"0 bytes in 0 chunk file|expected numbers of nodes"):
        read(path)


@pytest.mark.parametrize(("shape", "more"), [([2, 2, 16_802_216], 0), ([3, 5, 4_480_591], 1)])
def test_an_array_of_a_stored_byte(tmp_path, shape, more):
    assert np.prod(shape) == (1 << 26) + 100_000 + more
    path = old(tmp_path / "a.zarr", count=0, dtype="|u1", shape=shape, chunks=shape)
    (path / "0.0.0").write_bytes(b"x")
    with pytest.raises(DamagedVolumeError, match="the store is incomplete" if more else "1 bytes for the"):
        read(path)


def test_a_chunk_file_is_not_read_beyond_what_it_can_hold(tmp_path, monkeypatch):
    monkeypatch.setattr(zarr_chunks, "SLACK", 10)
    path = old(tmp_path / "a.zarr")
    size = 3 * 7 * 9 * 2
    for extra, told in (
        (10, f"{2 * size + 10} bytes for the {size} of its values"),
        (11, f"{2 * size + 11} bytes for the"),
    ):
        (path / "1.0.0").write_bytes(bytes(2 * size + extra))
        with pytest.raises(DamagedVolumeError, match=rf"chunk 1\.0\.0 cannot be read \({told}"):
            read(path)


def test_steps_that_pass_their_limit(tmp_path):
    values = np.zeros(100_000, "u1")
    packing = zarr_codecs.Packing(np.dtype("u1"), (0, 1, 2), (lambda content, most: bytes(most + 1),))
    with pytest.raises(ValueError, match="more than the 8 bytes of its values"):
        packing.unpack(values.tobytes(), (2, 2, 2))
    whole = zarr_codecs.Packing(np.dtype("u1"), (0, 1, 2), (lambda content, most: bytes(8),))
    np.testing.assert_array_equal(whole.unpack(b"", (2, 2, 2)), np.zeros((2, 2, 2)))
    with pytest.raises(ValueError, match="9 codecs one after the other"):
        zarr_codecs.Packing(np.dtype("u1"), (0,), whole.steps * 9)
    assert len(zarr_codecs.Packing(np.dtype("u1"), (0,), whole.steps * 8).steps) == 8
    limits = []
    zarr_codecs.Packing(
        np.dtype("u1"), (0, 1, 2), (lambda content, most: bytes(8 + 0 * bool(limits.append(most))),)
    ).unpack(b"", (2, 2, 2))
    assert limits == [8 * 8 + (1 << 16)]


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "numcodecs", None)
    with pytest.raises(
        UnsupportedFormatError, match=r"codec blosc found, but its package is missing; pip install"
    ):
        read(old(tmp_path / "a.zarr", compressor={"id": "blosc"}))
    np.testing.assert_array_equal(read(old(tmp_path / "b.zarr")).values, VALUES)


def image(folder, multiscales, version=2):
    folder.mkdir(parents=True, exist_ok=True)
    if version == 2:
        (folder / ".zgroup").write_text('{"zarr_format": 2}')
        (folder / ".zattrs").write_text(json.dumps({"multiscales": multiscales}))
    else:
        told = {"zarr_format": 3, "node_type": "group", "attributes": {"ome": {"multiscales": multiscales}}}
        (folder / "zarr.json").write_text(json.dumps(told))
    return folder


LEVEL = [{"axes": [{"name": n} for n in "zyx"], "datasets": [{"path": "a/b"}]}]


@pytest.mark.parametrize("version", [2, 3])
def test_a_level_deep_in_a_store(tmp_path, version):
    path = image(tmp_path / "a.zarr", LEVEL, version)
    with pytest.raises(DamagedVolumeError, match="level 'a/b' of the image is no array"):
        read(path)
    old(path / "a/b")
    np.testing.assert_array_equal(read(path).values, VALUES)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert (entry.size, entry.description) == ((9, 7, 6), "zarr")


@pytest.mark.parametrize("told", [[], None, [{}], [{"datasets": []}], "x"])
def test_a_group_without_an_image_names_its_arrays(tmp_path, told):
    path = image(tmp_path / "a.zarr", told)
    for name in ("one", "two"):
        old(path / name)
    with pytest.raises(VolumeError, match=r"without an OME image found, with one, two; give|cannot be read"):
        read(path)


def test_arrays_have_three_axes_or_more(tmp_path):
    with pytest.raises(
        UnsupportedFormatError, match=r"an array of shape \(6, 7\) found; expected axes z, y, x"
    ):
        read(flat(tmp_path))
    four = old(tmp_path / "b.zarr", count=0)
    (four / ".zarray").write_text(json.dumps(OLD | {"shape": [2, 6, 7, 9], "chunks": [1, 6, 7, 9]}))
    for k in range(2):
        (four / f"{k}.0.0.0").write_bytes((VALUES + k).tobytes())
    with pytest.raises(AmbiguousVolumeError, match="2 volumes found"):
        read(four)
    with pytest.raises(SettingsError, match="expected 0 to 1"):
        read(four, volume_index=2)
    np.testing.assert_array_equal(read(four, volume_index=1).values, VALUES + 1)


def flat(folder):
    path = old(folder / "flat.zarr", count=0)
    (path / ".zarray").write_text(json.dumps(OLD | {"shape": [6, 7], "chunks": [6, 7]}))
    return path


def test_metadata_have_an_end(tmp_path, monkeypatch):
    path = old(tmp_path / "a.zarr")
    size = (path / ".zarray").stat().st_size
    monkeypatch.setattr(zarr_metadata, "MAX_METADATA", size)
    assert read(path).shape == (9, 7, 6)
    monkeypatch.setattr(zarr_metadata, "MAX_METADATA", size - 1)
    with pytest.raises(DamagedVolumeError, match=r"\.zarray has more than \d+ bytes"):
        read(path)
    monkeypatch.undo()
    for more in (0, 1):
        with (path / ".zarray").open("a") as file:
            file.write(" " * (more or (1 << 24) - size))
        if not more:
            assert read(path).shape == (9, 7, 6)
            continue
        with pytest.raises(DamagedVolumeError, match=r"\.zarray has more than 16777216 bytes"):
            read(path)
