"""Which dataset of an HDF5 file is meant: the one named, the one NeXus shows, the only one."""

import gzip

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, SettingsError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import check_input, list_volumes
from tests.volume_io.hdf5.files import VALUES, codes, write
from tests.volume_io.minc_files import hdf as minc
from tests.volume_io.reading import counting, read

h5py = pytest.importorskip("h5py")


@pytest.mark.parametrize(
    "storage", [{}, {"chunks": (2, 2, 5)}, {"compression": "gzip", "shuffle": True}, {"compression": "lzf"}]
)
@pytest.mark.parametrize("dtype", ["<i2", ">u4", "f8", "<f2", "?"])
def test_the_only_volume_of_a_file_is_read(path, storage, dtype):
    values = VALUES.astype(dtype)
    with h5py.File(path, "w") as file:
        file.create_dataset("entry/data", data=values, **storage)
        file["entry/table"] = np.zeros((30, 4))
        file["entry/names"] = ["a", "b"]
    volume = read(path)
    np.testing.assert_array_equal(volume.values, values)
    assert (volume.format, volume.space, volume.files) == ("hdf5", "none", (path,))
    assert codes(volume) == ["W-SPACING-MISSING"]
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.size == (6, 5, 4)


def test_a_dataset_is_chosen_by_its_path(path):
    write(path, {"entry/one": VALUES, "entry/two": VALUES + 1})
    with pytest.raises(AmbiguousVolumeError, match=r"2 datasets .*/one of 4 x 5 x 6, .*a.h5:/entry/one"):
        read(path)
    for named in ("/entry/two", "entry/two"):
        volume = read(f"{path}:{named}")
        np.testing.assert_array_equal(volume.values, VALUES + 1)
        assert volume.files == (path,)
    check_input(f"{path}:/entry/two", ReadSettings())
    assert list_volumes(f"{path}:/entry/two", ReadSettings())[0].size == (6, 5, 4)
    with pytest.raises(VolumeError, match=r"/entry/three is no dataset; expected one of .*/entry/one of"):
        read(f"{path}:/entry/three")


def test_a_packed_file_has_datasets_too(path):
    content = write(path, {"one": VALUES, "two": VALUES + 1}).read_bytes()
    packed = path.with_name("b.h5.gz")
    packed.write_bytes(gzip.compress(content))
    volume = read(f"{packed}:/two")
    np.testing.assert_array_equal(volume.values, VALUES + 1)
    assert volume.files == (packed,)


def test_a_group_stands_for_its_only_dataset(path):
    write(
        path, {"one/data": VALUES, "two/data": VALUES + 1, "two/more/data": VALUES, "none/table": np.zeros(3)}
    )
    np.testing.assert_array_equal(read(f"{path}:/one").values, VALUES)
    with pytest.raises(AmbiguousVolumeError, match=r"2 datasets found .*choose with .*a\.h5:/two/data"):
        read(f"{path}:/two")
    with pytest.raises(UnsupportedFormatError, match="without a dataset of numbers along three axes"):
        read(f"{path}:/none")


def test_a_colon_in_a_name_stays_one(tmp_path):
    path = write(tmp_path / "a.h5:data", {"data": VALUES})
    (tmp_path / "a.h5").write_bytes(b"something else")
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_a_minc_file_is_known_by_its_content(tmp_path):
    path = minc(tmp_path / "b", VALUES.astype("u1"), 0.0, 1.0)
    assert read(path).format == "minc"
    with pytest.raises(UnsupportedFormatError, match="a MINC 2 file found; read it with --input-format minc"):
        read(path, input_format="hdf5")


def test_times_before_the_grid_are_volumes_to_choose_from(path):
    values = counting((3, 4, 5, 6), "<i2")
    write(path, {"data": values})
    with pytest.raises(AmbiguousVolumeError, match=r"3 volumes found.*--volume-index"):
        read(path)
    np.testing.assert_array_equal(read(path, volume_index=2).values, values[2])
    with pytest.raises(SettingsError, match="3 volumes"):
        read(path, volume_index=3)
    assert "3 volumes" in list_volumes(str(path), ReadSettings())[0].description


@pytest.mark.parametrize("kind", ["group", "dataset", "text"])
def test_the_only_signal_of_a_file_is_shown(path, kind):
    """NXdata by its attribute `signal`; before 2014 the dataset had it, as a number or a text."""
    write(path, {"entry/data/counts": VALUES, "entry/data/errors": VALUES + 1})
    with h5py.File(path, "a") as file:
        if kind == "group":
            file["entry/data"].attrs.update(NX_class="NXdata", signal="counts")
        else:
            file["entry/data/counts"].attrs["signal"] = 1 if kind == "dataset" else "1"
    np.testing.assert_array_equal(read(path).values, VALUES)
    with h5py.File(path, "a") as file:
        file["entry/data/errors"].attrs["signal"] = 1
        file["entry/data/counts"].attrs["signal"] = 1
    with pytest.raises(AmbiguousVolumeError, match="2 datasets found"):
        read(path)


def test_what_matlab_keeps_for_itself_is_no_choice(path):
    write(path, {"image": VALUES, "#refs#/a": VALUES + 1})
    np.testing.assert_array_equal(read(path).values, VALUES)
