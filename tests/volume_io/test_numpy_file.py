import zipfile

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.cases import case
from tests.volume_io.reading import counting, read

VALUES = counting((3, 4, 5))


@pytest.mark.parametrize("dtype", ["u1", "i1", "<i2", ">i2", "<u4", "<i8", "<f4", ">f8"])
@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("suffix", [".npy", ".npz"])
def test_every_type_order_and_container(tmp_path, dtype, order, suffix):
    values = np.asarray(VALUES.astype(dtype), order=order)
    if suffix == ".npy":
        np.save(tmp_path / "a.npy", values)
    else:
        np.savez_compressed(tmp_path / "a.npz", volume=values, spacing=[1, 2, 3])
    volume = read(tmp_path / f"a{suffix}", spacing=(1, 2, 3), origin=(4, 5, 6))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.values.dtype == np.dtype(dtype).newbyteorder("=")
    assert volume.values.flags.c_contiguous
    np.testing.assert_array_equal(volume.affine, [[1, 0, 0, 4], [0, 2, 0, 5], [0, 0, 3, 6], [0, 0, 0, 1]])


def test_an_npy_file_is_mapped(tmp_path):
    np.save(tmp_path / "a.npy", VALUES)
    assert not read(tmp_path / "a.npy").values.flags.owndata
    assert not read(tmp_path / "a.npy").values.flags.writeable


@pytest.mark.parametrize(("dtype", "becomes"), [("f2", "f4"), ("?", "u1")])
@pytest.mark.parametrize("suffix", [".npy", ".npz"])
def test_half_floats_and_truth_values_are_widened(tmp_path, dtype, becomes, suffix):
    values = (VALUES % 2).astype(dtype)
    np.save(tmp_path / "a.npy", values)
    np.savez(tmp_path / "a.npz", values)
    volume = read(tmp_path / f"a{suffix}")
    assert volume.values.dtype == np.dtype(becomes)
    np.testing.assert_array_equal(volume.values, VALUES % 2)


def test_several_volumes_are_chosen_by_index(tmp_path):
    four = counting((2, 3, 4, 5))
    np.save(tmp_path / "a.npy", four)
    np.savez(tmp_path / "a.npz", first=four[0], second=four[1])
    for suffix in (".npy", ".npz"):
        with pytest.raises(AmbiguousVolumeError, match="2 volumes found"):
            read(tmp_path / f"a{suffix}")
        np.testing.assert_array_equal(read(tmp_path / f"a{suffix}", volume_index=1).values, four[1])


@pytest.mark.parametrize("index", [None, 0])
def test_an_array_without_volumes_is_refused(tmp_path, index):
    np.save(tmp_path / "a.npy", VALUES[None][:0])
    with pytest.raises(DamagedVolumeError, match=": 0 volumes found; expected one or some"):
        read(tmp_path / "a.npy", volume_index=index)


@pytest.mark.parametrize(
    "values", [VALUES + 1j, VALUES.astype(object), np.zeros((3, 4)), np.zeros((2, 3, 4), [("a", "i2")])]
)
def test_other_arrays_are_refused(tmp_path, values):
    np.save(tmp_path / "a.npy", values, allow_pickle=True)
    np.savez(tmp_path / "a.npz", values, allow_pickle=True)
    for suffix in (".npy", ".npz"):
        with pytest.raises(UnsupportedFormatError):
            read(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", [".npy", ".npz"])
@pytest.mark.parametrize("kept", [5, 20, 100, -1])
def test_truncated_files_are_refused(tmp_path, suffix, kept):
    np.save(tmp_path / "a.npy", VALUES)
    np.savez(tmp_path / "a.npz", VALUES)
    path = tmp_path / f"a{suffix}"
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(VolumeError) as caught:
        read(path)
    assert caught.value.exit_status == 3


def test_a_truncated_array_tells_how_many_bytes_there_are(tmp_path):
    np.save(tmp_path / "a.npy", VALUES)
    content = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(content[:-1])
    with pytest.raises(
        DamagedVolumeError, match=r": 119 bytes of values found, 120 expected for \(3, 4, 5\) values of int16"
    ):
        read(tmp_path / "a.npy")


def test_a_size_that_the_file_cannot_hold_is_refused(tmp_path):
    np.save(tmp_path / "a.npy", VALUES)
    content = (tmp_path / "a.npy").read_bytes()
    assert b"(3, 4, 5), }" + b" " * 8 in content
    (tmp_path / "a.npy").write_bytes(content.replace(b"(3, 4, 5), }" + b" " * 8, b"(30000, 40000, 5), }"))
    with pytest.raises(DamagedVolumeError, match="12000000000 expected"):
        read(tmp_path / "a.npy")
    (tmp_path / "a.npy").write_bytes(content.replace(b"}", b"("))
    with pytest.raises(DamagedVolumeError, match="header"):
        read(tmp_path / "a.npy")


@pytest.mark.parametrize(("length", "taken"), [(10_000, True), (10_001, False)])
def test_a_header_is_so_long_at_most(tmp_path, length, taken):
    np.save(tmp_path / "a.npy", VALUES)
    content = (tmp_path / "a.npy").read_bytes()
    text = content[10:128].rstrip().ljust(length - 1) + b"\n"
    (tmp_path / "a.npy").write_bytes(content[:8] + length.to_bytes(2, "little") + text + content[128:])
    if taken:
        np.testing.assert_array_equal(read(tmp_path / "a.npy").values, VALUES)
        return
    with pytest.raises(DamagedVolumeError, match="the array's header cannot be read"):
        read(tmp_path / "a.npy")


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_every_version_of_the_format(tmp_path, version):
    with (tmp_path / "a.npy").open("wb") as file:
        np.lib.format.write_array(file, VALUES, version=version)
    np.testing.assert_array_equal(read(tmp_path / "a.npy").values, VALUES)


def zipped(path, content):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", content)
    return path


@pytest.mark.parametrize("claimed", [10**6, 248])
def test_an_entry_of_an_npz_that_claims_what_it_has_not(tmp_path, claimed):
    np.save(tmp_path / "a.npy", VALUES)
    content = (tmp_path / "a.npy").read_bytes()
    path = zipped(tmp_path / "a.npz", content if claimed > 248 else content[:-1])
    packed = bytearray(path.read_bytes())
    place = packed.rindex(b"PK\1\2") + 24
    packed[place : place + 4] = claimed.to_bytes(4, "little")
    path.write_bytes(packed)
    told = "1000000 bytes found, 120 expected" if claimed > 248 else "119 bytes of values found, 120 expected"
    with pytest.raises(DamagedVolumeError, match=told):
        read(path)


def test_an_entry_of_an_npz_that_is_shorter_than_its_values(tmp_path):
    np.save(tmp_path / "a.npy", counting((30, 4, 5)))
    content = (tmp_path / "a.npy").read_bytes()
    with pytest.raises(DamagedVolumeError, match="1199 bytes found, 1200 expected"):
        read(zipped(tmp_path / "a.npz", content[:1199]))


@given(shape=st.tuples(*[st.integers(2, 6)] * 3), seed=st.integers(0, 99))
def test_what_numpy_writes_is_read_back(tmp_path_factory, shape, seed):
    values = np.random.default_rng(seed).normal(size=shape)
    path = tmp_path_factory.mktemp("numpy") / "a.npz"
    np.savez_compressed(path, values)
    np.testing.assert_array_equal(read(path).values, values)


@given(
    shape=st.lists(st.integers(1, 3), min_size=0, max_size=2).flatmap(
        lambda leading: st.tuples(*[st.just(n) for n in leading], *[st.integers(2, 4)] * 3)
    ),
    trailing=st.integers(0, 1),
    order=st.sampled_from("CF"),
    dtype=st.sampled_from(["<f4", ">i2", "?"]),
    suffix=st.sampled_from([".npy", ".npz"]),
    data=st.data(),
)
@settings(max_examples=30)
def test_arrays_of_more_axes_hold_volumes(tmp_path_factory, shape, trailing, order, dtype, suffix, data):
    values = np.asarray(counting(shape).astype(dtype).reshape(shape + (1,) * trailing), order=order)
    path = tmp_path_factory.mktemp("numpy") / f"a{suffix}"
    if suffix == ".npy":
        np.save(path, values)
    else:
        np.savez_compressed(path, values)
    flat = counting(shape).astype(dtype).reshape(-1, *shape[-3:])
    index = data.draw(st.integers(0, len(flat) - 1))
    volume = read(path, volume_index=index, spacing=(1, 1, 1))
    np.testing.assert_array_equal(volume.values, flat[index])
    assert [notice.code for notice in volume.warnings] == ["W-AXES-MISSING"] * (len(flat) > 1)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert (entry.size, len(entry.volumes)) == (shape[:-4:-1], len(flat))


def test_arrays_of_an_npz_are_counted_together(tmp_path):
    data, seg = counting((2, 3, 4, 5)), counting((1, 4, 4, 4), "u1")
    np.savez_compressed(tmp_path / "a.npz", data=data, seg=seg, spacing=[1, 2, 3])
    with pytest.raises(AmbiguousVolumeError, match=r"3 volumes found \(0 to 1: data, 2: seg\)"):
        read(tmp_path / "a.npz")
    np.testing.assert_array_equal(read(tmp_path / "a.npz", volume_index=1).values, data[1])
    np.testing.assert_array_equal(read(tmp_path / "a.npz", volume_index=2).values, seg[0])


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("case_001.npz", 2),
        ("case_v1.npz", 2),
        ("case_v1.npy", 2),
        ("channel_last.npy", 1),
        ("plain3d.npz", 1),
    ],
)
def test_the_cases_of_nnunet(name, count):
    path = case(f"npz_nnunet/{name}")
    stored = np.load(path)
    arrays = [stored] if isinstance(stored, np.ndarray) else [stored[key] for key in stored]
    volumes = [volume for array in arrays for volume in array.reshape(-1, 40, 48, 64)]
    assert len(volumes) == count
    for index, expected in enumerate(volumes):
        np.testing.assert_array_equal(read(path, volume_index=index).values, expected)
    if count > 1:
        with pytest.raises(AmbiguousVolumeError, match="2 volumes found"):
            read(path)


@pytest.mark.parametrize(
    ("shape", "is_told"),
    [
        ((20, 30, 3), True),
        ((20, 30, 4), True),
        ((1, 20, 30, 3), True),
        ((20, 30, 5), False),
        ((3, 20, 30), False),
        ((8, 30, 3), False),
    ],
)
def test_what_may_be_a_picture_is_told(tmp_path, shape, is_told):
    np.save(tmp_path / "a.npy", np.zeros(shape, "u1"))
    volume = read(tmp_path / "a.npy", spacing=(1, 1, 1))
    assert [notice.code for notice in volume.warnings] == ["W-AXES-MISSING"] * is_told


@pytest.mark.parametrize("name", ["spacing", "voxel_size", "Affine"])
def test_lengths_beside_the_array_of_an_npz_are_told(tmp_path, name):
    path = tmp_path / "a.npz"
    np.savez(path, volume=np.zeros((4, 5, 6)), **{name: np.ones(3)})
    volume = read(path)
    assert [notice.code for notice in volume.warnings] == ["W-UNIT-MISSING", "W-SPACING-MISSING"]
    assert repr(name) in volume.warnings[0].sentence
    assert read(path, spacing=(1, 2, 3)).warnings == ()
