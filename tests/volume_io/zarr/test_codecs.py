"""Chunks however they are packed, against stores that zarr writes; and what must never be unpacked."""

import json
import lzma
import os
import pickle
import struct

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from tests.volume_io.reading import counting, read

zarr = pytest.importorskip("zarr", minversion="3")
numcodecs = pytest.importorskip("numcodecs")
google_crc32c = pytest.importorskip("google_crc32c")

VALUES = counting((6, 7, 9), "<i2")
STORE = {"zarr_format": 2, "shape": [6, 7, 9], "chunks": [6, 7, 9], "dtype": "<i2", "fill_value": 0}
STORE |= {"compressor": None, "order": "C", "filters": None}


def store(folder, content=None, **changes):
    """Return a store of version 2 with one chunk, written by hand."""
    folder.mkdir()
    (folder / ".zarray").write_text(json.dumps(STORE | changes))
    (folder / "0.0.0").write_bytes(VALUES.tobytes() if content is None else content)
    return folder


def written(folder, values=VALUES, chunks=(4, 3, 5), **options):
    array = zarr.create_array(folder, shape=values.shape, chunks=chunks, dtype=values.dtype, **options)
    array[...] = values
    return folder


PACKED_2 = {
    "none": {"compressors": None},
    "blosc": {"compressors": numcodecs.Blosc("lz4", shuffle=2)},
    "zstd": {"compressors": numcodecs.Zstd()},
    "lz4": {"compressors": numcodecs.LZ4()},
    "zlib": {"compressors": numcodecs.Zlib()},
    "gzip": {"compressors": numcodecs.GZip()},
    "bz2": {"compressors": numcodecs.BZ2()},
    "lzma": {"compressors": numcodecs.LZMA()},
    "lzma alone": {"compressors": numcodecs.LZMA(format=lzma.FORMAT_ALONE)},
    "lzma raw": {"compressors": numcodecs.LZMA(lzma.FORMAT_RAW, filters=[{"id": lzma.FILTER_LZMA2}])},
    "delta": {"filters": [numcodecs.Delta("<i2")], "compressors": numcodecs.Zlib()},
    "delta of bytes": {"filters": [numcodecs.Delta("<i2", "<i4")], "compressors": None},
    "shuffle": {"filters": [numcodecs.Shuffle(2)], "compressors": numcodecs.GZip()},
    "scaled": {"filters": [numcodecs.FixedScaleOffset(3, 1, "<i2", "<i4")], "compressors": None},
    "other type": {"filters": [numcodecs.AsType("<f8", "<i2")], "compressors": numcodecs.Zlib()},
    "checksum": {"filters": [numcodecs.Fletcher32()], "compressors": None},
    "crc32": {"filters": [numcodecs.CRC32()], "compressors": None},
    "several": {"filters": [numcodecs.Delta("<i2"), numcodecs.Adler32()], "compressors": numcodecs.BZ2()},
    "fortran": {"order": "F"},
    "folders": {"chunk_key_encoding": {"name": "v2", "separator": "/"}},
}


@pytest.mark.parametrize("packed", PACKED_2)
def test_every_way_of_packing_in_version_2(tmp_path, packed):
    path = written(tmp_path / "a.zarr", zarr_format=2, **PACKED_2[packed])
    np.testing.assert_array_equal(read(path).values, VALUES)


CODECS = zarr.codecs
PACKED_3 = {
    "none": {"compressors": None},
    "blosc": {"compressors": CODECS.BloscCodec(cname="zstd", shuffle="bitshuffle")},
    "zstd": {"compressors": CODECS.ZstdCodec()},
    "gzip": {"compressors": CODECS.GzipCodec()},
    "crc32c": {"compressors": [CODECS.Crc32cCodec()]},
    "two": {"compressors": [CODECS.GzipCodec(), CODECS.Crc32cCodec()]},
    "big endian": {"serializer": CODECS.BytesCodec(endian="big"), "compressors": None},
    "transposed": {"filters": [CODECS.TransposeCodec(order=(2, 0, 1))]},
    "transposed twice": {
        "filters": [CODECS.TransposeCodec(order=(2, 0, 1)), CODECS.TransposeCodec(order=(1, 0, 2))]
    },
    "shards": {"shards": (8, 9, 10)},
    "shards, index first": {"shards": {"shape": (8, 9, 10), "index_location": "start"}},
    "dots": {"chunk_key_encoding": {"name": "default", "separator": "."}},
    "names of version 2": {"chunk_key_encoding": {"name": "v2", "separator": "."}},
}


@pytest.mark.parametrize("packed", PACKED_3)
def test_every_way_of_packing_in_version_3(tmp_path, packed):
    path = written(tmp_path / "a.zarr", zarr_format=3, **PACKED_3[packed])
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.values.dtype.isnative


@pytest.mark.filterwarnings("ignore:Numcodecs codecs are not in the Zarr version 3 specification")
def test_codecs_of_numcodecs_in_version_3(tmp_path):
    wrapped = pytest.importorskip("zarr.codecs.numcodecs")

    codecs = {
        "filters": [wrapped.Delta(dtype="<i2")],
        "compressors": [wrapped.Shuffle(elementsize=2), wrapped.LZ4()],
    }
    path = written(tmp_path / "a.zarr", zarr_format=3, **codecs)
    np.testing.assert_array_equal(read(path).values, VALUES)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("dtype", ["u1", "i1", ">u2", "i4", "u8", ">f4", "f8"])
def test_every_type_of_values(tmp_path, version, dtype):
    values = counting((6, 7, 9), dtype) % 100
    path = written(tmp_path / "a.zarr", values.astype(dtype), zarr_format=version)
    found = read(path).values
    np.testing.assert_array_equal(found, values)
    assert found.dtype == np.dtype(dtype).newbyteorder("=")


@pytest.mark.parametrize(
    ("dtype", "fill"), [("i2", -7), ("f4", "NaN"), ("f8", "-Infinity"), ("f4", 2.5), ("u1", None)]
)
@pytest.mark.parametrize("version", [2, 3])
def test_a_missing_chunk_holds_the_fill_value(tmp_path, version, dtype, fill):
    options = {} if fill is None else {"fill_value": np.dtype(dtype).type(float(fill))}
    values = counting((6, 7, 9), dtype)
    path = written(tmp_path / "a.zarr", values, zarr_format=version, **options)
    (path / ("1.1.0" if version == 2 else "c/1/1/0")).unlink()
    found = read(path).values
    values[4:, 3:6, :5] = float(fill or 0)
    np.testing.assert_array_equal(found, values)


def test_a_fill_value_in_hexadecimal_and_chunks_missing_of_a_shard(tmp_path):
    values = np.zeros((6, 7, 9), "f4")
    values[5, 6, 8] = 3
    path = written(
        tmp_path / "a.zarr", values, zarr_format=3, shards=(8, 9, 10), config={"write_empty_chunks": False}
    )
    told = json.loads((path / "zarr.json").read_text()) | {"fill_value": "0x40b00000"}
    (path / "zarr.json").write_text(json.dumps(told))
    values[values == 0] = 5.5
    values[4:, 6:, 5:] = 0
    values[5, 6, 8] = 3
    np.testing.assert_array_equal(read(path).values, values)


@pytest.mark.parametrize(
    ("dtype", "fill", "becomes"), [("f2", 2.5, "f4"), ("?", True, "u1"), ("?", False, "u1")]
)
@pytest.mark.parametrize("version", [2, 3])
def test_half_floats_and_truth_values_are_widened(tmp_path, version, dtype, fill, becomes):
    values = (counting((6, 7, 9)) % 2).astype(dtype)
    path = written(tmp_path / "a.zarr", values, zarr_format=version, fill_value=fill)
    (path / ("1.1.0" if version == 2 else "c/1/1/0")).unlink()
    found = read(path).values
    values[4:, 3:6, :5] = fill
    np.testing.assert_array_equal(found, values.astype(becomes))
    assert found.dtype == np.dtype(becomes)


def test_a_fill_value_of_truth_values_is_one(tmp_path):
    with pytest.raises(DamagedVolumeError, match="expected true or false"):
        read(store(tmp_path / "a.zarr", bytes(6 * 7 * 9), dtype="|b1", fill_value=2))


def test_a_fill_value_is_a_number_of_its_type(tmp_path):
    with pytest.raises(DamagedVolumeError, match=r"fill value 1e\+39 found; expected a float32"):
        read(store(tmp_path / "a.zarr", bytes(4 * 6 * 7 * 9), dtype="<f4", fill_value=1e39))


@pytest.mark.parametrize("sharded", [False, True])
def test_a_volume_among_several_is_put_together_from_its_own_chunks(tmp_path, sharded):
    values = counting((3, 5, 6, 7, 9), "<u2")
    options = {"shards": (2, 4, 8, 9, 10)} if sharded else {}
    path = written(tmp_path / "a.zarr", values, chunks=(2, 2, 4, 3, 5), zarr_format=3, **options)
    np.testing.assert_array_equal(read(path, volume_index=2 * 5 + 3).values, values[2, 3])


RUN = pickle.dumps(print)


@pytest.mark.parametrize("place", ["filters", "compressor", "beside others"])
def test_a_codec_that_runs_code_is_refused_before_a_chunk_is_looked_at(tmp_path, place):
    pickled = {"id": "pickle", "protocol": 5}
    changes = {
        "filters": {"filters": [pickled]},
        "compressor": {"compressor": pickled},
        "beside others": {
            "filters": [{"id": "delta", "dtype": "<i2"}, pickled],
            "compressor": {"id": "zlib"},
        },
    }[place]
    with pytest.raises(DamagedVolumeError, match=r"codec 'pickle' found; expected one of zlib, .*convert"):
        read(store(tmp_path / "a.zarr", RUN, **changes))


@pytest.mark.parametrize(
    "consolidated", [{"filters": [{"id": "pickle"}]}, {"compressor": {"id": "zlib"}}, {"shape": [1, 1, 1]}]
)
def test_consolidated_metadata_change_nothing(tmp_path, consolidated):
    """They repeat the others; what is checked and what is read must be the same."""
    path = store(tmp_path / "a.zarr")
    told = {"zarr_consolidated_format": 1, "metadata": {".zarray": STORE | consolidated}}
    (path / ".zmetadata").write_text(json.dumps(told))
    np.testing.assert_array_equal(read(path).values, VALUES)


@pytest.mark.parametrize(
    "changes",
    [
        {"filters": [{"id": "astype", "encode_dtype": "<U4000000", "decode_dtype": "<i2"}]},
        {"filters": [{"id": "delta", "dtype": "O"}]},
        {"filters": [{"id": "crc32"}] * 9},
        {
            "compressor": {
                "id": "lzma",
                "format": 3,
                "filters": [{"id": lzma.FILTER_LZMA2, "dict_size": 1 << 30}],
            }
        },
        {"chunks": [6, 7]},
        {"chunks": [6, 7, 0]},
        {"shape": [6, 7, True]},
        {"shape": [2**40, 7, 9]},
        {"order": "D"},
        {"dimension_separator": ":"},
        {"zarr_format": 3},
        {"fill_value": 0.5},
        {"fill_value": "1"},
        {"fill_value": 40_000},
    ],
    ids=str,
)
def test_metadata_that_cannot_be_meant_are_refused(tmp_path, changes):
    with pytest.raises(DamagedVolumeError, match=r"cannot be read .*get"):
        read(store(tmp_path / "a.zarr", **changes))


@pytest.mark.parametrize("dtype", ["<c8", "|O", "|V4", "<M8[ns]", [["a", "<i2"]]])
def test_values_that_are_no_numbers_are_refused(tmp_path, dtype):
    with pytest.raises(UnsupportedFormatError, match=r"values of type .*expected integers"):
        read(store(tmp_path / "a.zarr", dtype=dtype))


@pytest.mark.parametrize("missing", [-2, 2])
def test_a_chunk_of_another_size_is_refused(tmp_path, missing):
    content = VALUES.tobytes()[:-2] if missing < 0 else VALUES.tobytes() + b"\0\0"
    with pytest.raises(DamagedVolumeError, match=r"chunk 0\.0\.0 cannot be read .*bytes for the 756"):
        read(store(tmp_path / "a.zarr", content))


def version_3(folder, **changes):
    """Return a store of version 3, its metadata changed."""
    path = written(folder, zarr_format=3, shards=(8, 9, 10))
    told = json.loads((path / "zarr.json").read_text())
    for key, value in changes.items():
        told[key] = value(told[key]) if callable(value) else value
    (path / "zarr.json").write_text(json.dumps(told))
    return path


@pytest.mark.parametrize(
    "changes",
    [
        {"storage_transformers": [{"name": "x"}]},
        {"chunk_grid": lambda grid: grid | {"name": "rectilinear"}},
        {"chunk_key_encoding": {"name": "suffix"}},
        {"something": {"must_understand": True}},
        {"codecs": lambda codecs: [*codecs, {"name": "gzip"}]},
        {"data_type": {"name": "numpy.datetime64"}},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_extensions_of_version_3_are_told(tmp_path, changes):
    with pytest.raises(UnsupportedFormatError):
        read(version_3(tmp_path / "a.zarr", **changes))


def test_what_need_not_be_understood_is_passed_over(tmp_path):
    path = version_3(tmp_path / "a.zarr", something={"must_understand": False})
    np.testing.assert_array_equal(read(path).values, VALUES)


def changed_table(content, row, offset, size):
    """Return the bytes of a shard with another place of a chunk, its checksum right."""
    count = 2 * 3 * 2
    table = bytearray(content[-16 * count - 4 : -4])
    struct.pack_into("<QQ", table, 16 * row, offset, size)
    return content[: -16 * count - 4] + table + struct.pack("<I", google_crc32c.value(bytes(table)))


@pytest.mark.parametrize("damage", ["checksum", "place", "short"])
def test_a_damaged_table_of_a_shard_is_refused(tmp_path, damage):
    path = version_3(tmp_path / "a.zarr")
    shard = path / "c/0/0/0"
    content = shard.read_bytes()
    shard.write_bytes(
        {
            "checksum": content[:-1] + bytes([content[-1] ^ 1]),
            "place": changed_table(content, 3, len(content), 10),
            "short": content[-100:],
        }[damage]
    )
    with pytest.raises(DamagedVolumeError, match=r"chunk c/0/0/0 cannot be read"):
        read(path)


def test_a_wrong_checksum_of_a_chunk_is_told(tmp_path):
    path = written(tmp_path / "a.zarr", zarr_format=3, compressors=[CODECS.Crc32cCodec()])
    chunk = path / "c/0/0/0"
    chunk.write_bytes(b"\1" + chunk.read_bytes()[1:])
    with pytest.raises(DamagedVolumeError, match="a wrong checksum"):
        read(path)


def test_a_level_outside_of_the_store_is_refused(tmp_path):
    store(tmp_path / "secret")
    for path in ("../secret", "a/../../secret", "..\\secret"):
        image = tmp_path / "image.zarr"
        image.mkdir(exist_ok=True)
        (image / ".zgroup").write_text('{"zarr_format": 2}')
        axes = [{"name": n} for n in "zyx"]
        told = {"multiscales": [{"axes": axes, "datasets": [{"path": path}]}]}
        (image / ".zattrs").write_text(json.dumps(told))
        with pytest.raises(VolumeError, match="leads out of the store"):
            read(image, allow_outside=True)


@pytest.mark.parametrize("linked", ["0.0.0", ".zarray"])
def test_links_out_of_a_store_are_followed_only_when_asked(tmp_path, linked):
    path = store(tmp_path / "a.zarr")
    (path / linked).rename(tmp_path / "elsewhere")
    (path / linked).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(VolumeError, match=r"link out of .*--allow-outside"):
        read(path)
    np.testing.assert_array_equal(read(path, allow_outside=True).values, VALUES)


def test_a_linked_folder_out_of_a_store_is_not_taken_for_missing_chunks(tmp_path):
    path = written(tmp_path / "a.zarr", zarr_format=3)
    (path / "c/0").rename(tmp_path / "elsewhere")
    (path / "c/0").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(VolumeError, match=r"c/0 is not read: a link out of .*--allow-outside"):
        read(path)
    np.testing.assert_array_equal(read(path, allow_outside=True).values, VALUES)


def test_links_within_a_store_are_followed(tmp_path):
    path = written(tmp_path / "a.zarr", zarr_format=2)
    (path / "1.1.1").rename(path / "moved")
    (path / "1.1.1").symlink_to("moved")
    np.testing.assert_array_equal(read(path).values, VALUES)


@pytest.mark.parametrize("allowed", [False, True])
@pytest.mark.parametrize("place", ["0.0.0", ".zarray"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_pipes_and_devices_are_never_opened(tmp_path, place, kind, allowed):
    path = store(tmp_path / "a.zarr")
    (path / place).unlink()
    if kind == "pipe":
        os.mkfifo(path / place)
    else:
        (path / place).symlink_to("/dev/zero")
    with pytest.raises(VolumeError):
        read(path, allow_outside=allowed, input_format="zarr")
