import zlib

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so
from hypothesis import given, strategies as st

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.reading import assert_same_as_itk, counting, read

VALUES = counting((4, 3, 2))


def header(data_file="LOCAL", sizes="2 3 4", kind="MET_SHORT", extra=""):
    return (
        f"ObjectType = Image\nNDims = {len(sizes.split())}\nDimSize = {sizes}\nElementType = {kind}\n{extra}"
        f"ElementDataFile = {data_file}\n"
    )


def write(path, text, data=b""):
    path.write_bytes(text.encode() + data)
    return path


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("key", ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])
def test_both_byte_orders(tmp_path, order, key):
    values = VALUES.astype(order + "i2")
    path = write(tmp_path / "a.mha", header(extra=f"{key} = {order == '>'}\n"), values.tobytes())
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_each_triple_of_the_matrix_is_the_direction_of_one_axis(tmp_path):
    extra = "TransformMatrix = 0 1 0 0 0 1 1 0 0\nElementSpacing = 2 3 4\nOffset = 5 6 7\n"
    extra += "AnatomicalOrientation = RAI\n"
    path = write(tmp_path / "a.mha", header(extra=extra), VALUES.tobytes())
    volume = read(path)
    np.testing.assert_array_equal(volume.affine, [[0, 0, 4, 5], [2, 0, 0, 6], [0, 3, 0, 7], [0, 0, 0, 1]])
    assert volume.space == "LPS"
    assert_same_as_itk(volume, path)


def test_a_detached_file_is_mapped(tmp_path):
    (tmp_path / "a.raw").write_bytes(b"skip" + VALUES.tobytes())
    volume = read(write(tmp_path / "a.mhd", header("a.raw", extra="HeaderSize = 4\n")))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert not volume.values.flags.owndata


@pytest.mark.parametrize("extra", ["HeaderSize = -1\n", "HeaderSize = 4\n"])
def test_headers_of_data_files_are_skipped(tmp_path, extra):
    (tmp_path / "a.raw").write_bytes(b"skip" + VALUES.tobytes())
    np.testing.assert_array_equal(
        read(write(tmp_path / "a.mhd", header("a.raw", extra=extra))).values, VALUES
    )


def test_compressed_values(tmp_path):
    packed = zlib.compress(VALUES.tobytes())
    path = write(
        tmp_path / "a.mha",
        header(extra=f"CompressedData = True\nCompressedDataSize = {len(packed)}\n"),
        packed,
    )
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_text_values(tmp_path):
    text = " ".join(map(str, VALUES.ravel())).encode()
    np.testing.assert_array_equal(
        read(write(tmp_path / "a.mha", header(extra="BinaryData = False\n"), text)).values, VALUES
    )


def test_lists_and_patterns_of_slices(tmp_path):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k + 1:02d}.raw").write_bytes(plane.tobytes())
    listed = header("LIST") + "".join(f"s{k:02d}.raw\n" for k in (1, 2, 3, 4))
    np.testing.assert_array_equal(read(write(tmp_path / "list.mhd", listed)).values, VALUES)
    np.testing.assert_array_equal(read(write(tmp_path / "p.mhd", header("s%02d.raw 1 4 1"))).values, VALUES)


def test_channels_and_volumes_are_chosen_by_index(tmp_path):
    values = counting((5, 4, 3, 2, 3))
    path = write(
        tmp_path / "a.mha", header(sizes="2 3 4 5", extra="ElementNumberOfChannels = 3\n"), values.tobytes()
    )
    with pytest.raises(AmbiguousVolumeError, match="15 channels or volumes"):
        read(path)
    np.testing.assert_array_equal(read(path, volume_index=7).values, values[2, ..., 1])
    np.testing.assert_array_equal(read(path, channel="1", volume_index=2).values, values[2, ..., 1])
    assert list_volumes(str(path), ReadSettings())[0].volumes[7] == "axis 4 2, channel 1, 2 x 3 x 4"
    with pytest.raises(SettingsError, match="has no such axis"):  # the format does not say what it is
        read(path, time="2")


@pytest.mark.parametrize(
    ("text", "error", "told"),
    [
        ("nothing of the kind", UnsupportedFormatError, "no MetaImage header"),
        (header(kind="MET_STRING"), UnsupportedFormatError, "MET_STRING"),
        (header(sizes="2 3 -4"), DamagedVolumeError, "positive"),
        (header(sizes="2 3 x"), DamagedVolumeError, "finite numbers"),
        (header(sizes="2 3"), VolumeError, "three axes"),
        (header(sizes="2 3 1"), VolumeError, "at least two"),
        (header(sizes="20000 30000 40000"), DamagedVolumeError, "bytes found"),
        (header(extra="ElementSpacing = 1 1\n"), DamagedVolumeError, "expected 9, 3 and 3"),
        (header(extra="ElementSpacing = 1 1 0\n"), DamagedVolumeError, "span the space"),
        (header("nowhere.raw"), VolumeError, "nowhere.raw"),
        (header("s%02d.raw 1 4 0"), DamagedVolumeError, "pattern"),
        (header("s%s.raw 1 4 1"), DamagedVolumeError, "pattern"),
        (header(extra="CompressedData = True\n"), DamagedVolumeError, "damaged"),
    ],
)
def test_damaged_headers_are_refused(tmp_path, text, error, told):
    with pytest.raises(error, match=told):
        read(write(tmp_path / "a.mha", text, VALUES.tobytes()))


@pytest.mark.parametrize("compressed", [False, True])
def test_truncated_values_are_refused(tmp_path, compressed):
    sitk.WriteImage(sitk.GetImageFromArray(counting((9, 9, 9))), tmp_path / "a.mha", compressed)
    content = (tmp_path / "a.mha").read_bytes()
    (tmp_path / "a.mha").write_bytes(content[:-20])
    with pytest.raises(DamagedVolumeError, match=r"a\.mha"):
        read(tmp_path / "a.mha")


@given(
    shape=st.tuples(*[st.integers(2, 7)] * 3),
    seed=st.integers(0, 99),
    dtype=st.sampled_from(["u1", "i2", "u4", "f4", "f8"]),
    suffix=st.sampled_from([".mha", ".mhd"]),
    compressed=st.booleans(),
)
def test_what_simpleitk_writes_is_read_back(tmp_path_factory, shape, seed, dtype, suffix, compressed):
    draws = np.random.default_rng(seed)
    image = sitk.GetImageFromArray((draws.random(shape) * 200).astype(dtype))
    image.SetDirection(np.linalg.qr(draws.normal(size=(3, 3)))[0].ravel())
    image.SetSpacing(draws.random(3) + 0.1)
    image.SetOrigin(draws.normal(size=3))
    path = tmp_path_factory.mktemp("meta") / f"a{suffix}"
    sitk.WriteImage(image, str(path), compressed)
    assert_same_as_itk(read(path), path)


REAL = [
    "meta_aorta/aorta.mha",
    "raw_headmr_meta/HeadMRVolume.mha",
    "raw_headmr_meta/HeadMRVolume.mhd",
    "raw_headmr_meta/HeadMRVolumeCompressed.mha",
    "raw_headmr_meta/HeadMRVolumeWithDirection.mhd",
    "raw_headmr_meta/HeadMRVolumeWithDirection001.mhd",
    "raw_headmr_meta/HeadMRVolumeWithDirection002.mhd",
    "raw_headmr_meta/HeadMRVolumeWithDirection003.mhd",
]


@pytest.mark.parametrize("name", REAL)
def test_real_files_agree_with_simpleitk(shared_data, name):
    assert_same_as_itk(read(shared_data / name), shared_data / name)


@pytest.mark.parametrize(
    ("matrix", "told", "is_wrong"),
    [
        ("1 0 0 0 1 0 0 0 1", "RAI", False),
        ("-1 0 0 0 -1 0 0 0 1", "LPI", False),
        ("0 1 0 0 0 -1 1 0 0", "ASR", False),
        ("0.9 0.1 0 -0.1 0.9 0 0 0 1", "RAI", False),
        ("1 0 0 0 1 0 0 0 1", "???", False),
        ("1 0 0 0 1 0 0 0 1", "LPI", True),
        ("1 0 0 0 1 0 0 0 1", "RAS", True),
        (None, "ASR", True),
    ],
)
def test_an_orientation_in_words_that_is_another_is_told(tmp_path, matrix, told, is_wrong):
    """Letters say where axes come from, as ITK writes them."""
    extra = f"ElementSpacing = 1 2 3\nAnatomicalOrientation = {told}\n"
    extra += f"TransformMatrix = {matrix}\n" if matrix else ""
    volume = read(write(tmp_path / "a.mha", header(extra=extra), VALUES.tobytes()))
    assert [notice.code for notice in volume.warnings] == ["W-GEOMETRY-CONTRADICTED"] * is_wrong


@pytest.mark.parametrize(
    ("slope", "offset", "is_told"), [("1", "0", False), ("2", "0", True), ("1", "-1000", True)]
)
def test_a_function_of_the_values_is_told(tmp_path, slope, offset, is_told):
    extra = f"ElementSpacing = 1 2 3\nElementToIntensityFunctionSlope = {slope}\n"
    extra += f"ElementToIntensityFunctionOffset = {offset}\n"
    path = write(tmp_path / "a.mha", header(extra=extra), VALUES.tobytes())
    volume = read(path)
    assert_same_as_itk(volume, path)
    assert [notice.code for notice in volume.warnings] == ["W-VALUES-MAPPED"] * is_told


@pytest.mark.parametrize(
    ("extra", "codes"),
    [
        ("Offset = 1 2 3\nPosition = 1 2 3.0\n", []),
        ("Offset = 1 2 3\nPosition = 1 2 4\n", ["W-GEOMETRY-CONTRADICTED"]),
        ("Offset = 1 2 3\nOrigin = 1 2 4\nPosition = 0 0 0\n", ["W-GEOMETRY-CONTRADICTED"] * 2),
        (
            "Offset = 1 2 3\nRotation = 0 1 0 1 0 0 0 0 1\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n",
            ["W-GEOMETRY-CONTRADICTED"],
        ),
        (
            "Offset = 1 2 3\nBinaryDataByteOrderMSB = False\nElementByteOrderMSB = True\n",
            ["W-BITS-CONTRADICTED"],
        ),
    ],
)
def test_fields_that_mean_the_same_and_differ_are_told(tmp_path, extra, codes):
    path = write(tmp_path / "a.mha", header(extra=f"ElementSpacing = 1 2 3\n{extra}"), VALUES.tobytes())
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_array_equal(volume.affine, [[1, 0, 0, 1], [0, 2, 0, 2], [0, 0, 3, 3], [0, 0, 0, 1]])
    assert [notice.code for notice in volume.warnings] == codes


def test_a_field_that_stands_twice_is_damage(tmp_path):
    extra = "ElementSpacing = 1 2 3\nElementSpacing = {}\n"
    path = write(tmp_path / "a.mha", header(extra=extra.format("1 2 3")), VALUES.tobytes())
    assert read(path).spacing == (1, 2, 3)
    path = write(tmp_path / "b.mha", header(extra=extra.format("1 2 4")), VALUES.tobytes())
    with pytest.raises(DamagedVolumeError, match="ElementSpacing found twice"):
        read(path)
