import gzip

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, SettingsError, VolumeError
from tests.volume_io.reading import counting, read

SHAPE = (5, 4, 3)


def write(path, dtype="<i2", front=b""):
    path.write_bytes(front + counting(SHAPE[::-1], dtype).tobytes())
    return path


@pytest.mark.parametrize(
    "dtype", ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "float32", "float64"]
)
@pytest.mark.parametrize("order", ["little", "big"])
def test_every_type_in_both_byte_orders(tmp_path, dtype, order):
    path = write(tmp_path / "a.raw", np.dtype(dtype).newbyteorder(order))
    volume = read(path, shape=SHAPE, dtype=dtype, byte_order=order)
    np.testing.assert_array_equal(volume.values, counting(SHAPE[::-1], dtype))
    assert volume.values.dtype == np.dtype(dtype)


def test_x_is_fastest_and_the_file_is_mapped(tmp_path):
    volume = read(write(tmp_path / "a.raw"), shape=SHAPE, dtype="int16")
    assert volume.shape == SHAPE
    assert volume.values[0, 0, 1] == 1
    assert not volume.values.flags.owndata


def test_spacing_origin_and_no_space(tmp_path):
    volume = read(write(tmp_path / "a.raw"), shape=SHAPE, dtype="int16", spacing=(1, 2, 3), origin=(7, 8, 9))
    np.testing.assert_array_equal(volume.affine, [[1, 0, 0, 7], [0, 2, 0, 8], [0, 0, 3, 9], [0, 0, 0, 1]])
    assert volume.space == "none"


@pytest.mark.parametrize("skip", [1, 2, 62])
def test_bytes_are_skipped(tmp_path, skip):
    path = write(tmp_path / "a.raw", front=bytes(skip))
    volume = read(path, shape=SHAPE, dtype="int16", skip_bytes=skip)
    np.testing.assert_array_equal(volume.values, counting(SHAPE[::-1]))
    assert volume.values.flags.aligned


def test_a_gzipped_raw_file(tmp_path):
    (tmp_path / "a.raw.gz").write_bytes(gzip.compress(counting(SHAPE[::-1]).tobytes()))
    volume = read(tmp_path / "a.raw.gz", shape=SHAPE, dtype="int16")
    np.testing.assert_array_equal(volume.values, counting(SHAPE[::-1]))


def test_the_size_must_fit_shape_and_type(tmp_path):
    path = write(tmp_path / "a.raw")
    with pytest.raises(DamagedVolumeError, match=r"120 bytes found, 100 expected.*--skip-bytes 20"):
        read(path, shape=(5, 5, 2), dtype="int16")
    with pytest.raises(DamagedVolumeError, match=r"120 bytes found, 240 expected.*check --shape and --dtype"):
        read(path, shape=SHAPE, dtype="float32")


def test_shape_and_type_must_be_told(tmp_path):
    path = write(tmp_path / "a.raw")
    with pytest.raises(SettingsError, match="--shape X,Y,Z"):
        read(path, dtype="int16")
    with pytest.raises(SettingsError, match="--dtype"):
        read(path, shape=SHAPE)
    with pytest.raises(SettingsError, match="complex64"):
        read(path, shape=SHAPE, dtype="complex64")


def test_any_suffix_with_input_format_raw(tmp_path):
    assert read(write(tmp_path / "a.dat"), input_format="raw", shape=SHAPE, dtype="int16").shape == SHAPE


def test_a_single_layer_is_refused(tmp_path):
    with pytest.raises(VolumeError, match="at least two along each axis"):
        read(write(tmp_path / "a.raw"), shape=(60, 1, 1), dtype="int16")


def test_the_engine(shared_data):
    path = shared_data / "raw_engine/engine_256x256x110_uint8.raw"
    volume = read(path, shape=(256, 256, 110), dtype="uint8")
    np.testing.assert_array_equal(volume.values.ravel(), np.fromfile(path, "u1"))


def test_without_a_spacing_it_is_told(tmp_path):
    path = write(tmp_path / "a.raw")
    (notice,) = read(path, shape=SHAPE, dtype="int16").warnings
    assert (notice.code, notice.sentence) == (
        "W-SPACING-MISSING",
        "a raw file tells no spacing; 1 mm is taken; --spacing gives it",
    )
    assert read(path, shape=SHAPE, dtype="int16", spacing=(1, 1, 1)).warnings == ()
