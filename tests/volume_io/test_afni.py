import gzip
import shutil

import nibabel as nib
import numpy as np
import pytest
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
from tests.volume_io.afni_files import afni_header
from tests.volume_io.reading import assert_same_as_nibabel, counting, nibabels_own, read


def write(folder, values, packed=False, **fields):
    """Write sub-bricks [t, k, j, i] as a pair and return the header's path."""
    stored = values.tobytes()
    fields.setdefault("factors", (0.0,) * len(values))
    (folder / "a+orig.HEAD").write_text(afni_header(values.shape[:0:-1], **fields))
    if packed:
        (folder / "a+orig.BRIK.gz").write_bytes(gzip.compress(stored))
    else:
        (folder / "a+orig.BRIK").write_bytes(stored)
    return folder / "a+orig.HEAD"


@pytest.mark.parametrize(("kind", "dtype"), [(0, "u1"), (1, "<i2"), (1, ">i2"), (3, "<f4"), (3, ">f4")])
@pytest.mark.parametrize("packed", [False, True])
def test_every_type_order_and_packing_agrees_with_nibabel(tmp_path, kind, dtype, packed):
    values = counting((1, 3, 4, 5), dtype)
    order = "MSB_FIRST" if dtype[0] == ">" else "LSB_FIRST"
    path = write(tmp_path, values, packed, kind=kind, order=order)
    volume = read(path)
    assert_same_as_nibabel(volume, nib.load(path), 0)
    assert volume.values.dtype == np.dtype(dtype).newbyteorder("=")
    assert (volume.format, volume.sentences) == ("afni", ())


def test_distances_that_differ_from_the_matrix_are_told(tmp_path):
    """DELTA repeats the lengths of IJK_TO_DICOM_REAL's columns."""
    path = write(tmp_path, counting((1, 3, 4, 5), "<i2"), DELTA=(-2.0, 3.0, 5.0))
    volume = read(path)
    assert_same_as_nibabel(volume, nib.load(path), 0)
    (notice,) = volume.warnings
    assert notice.code == "W-GEOMETRY-CONTRADICTED"
    assert "DELTA is 2 x 3 x 5 mm, IJK_TO_DICOM_REAL has nodes 2 x 3 x 4 mm apart" in notice.sentence


@given(
    shape=st.tuples(*[st.integers(2, 5)] * 3),
    factors=st.lists(st.sampled_from([0.0, 1.0, 0.25, 3e-5, -2.0]), min_size=1, max_size=4),
)
def test_each_sub_brick_has_its_factor(tmp_path_factory, shape, factors):
    values = counting((len(factors), *shape))
    path = write(tmp_path_factory.mktemp("afni"), values, factors=factors)
    for index, factor in enumerate(factors):
        volume = read(path, volume_index=index)
        assert_same_as_nibabel(volume, nib.load(path), index)
        assert volume.slope == (factor or 1.0)
        np.testing.assert_array_equal(volume.values, values[index])


@pytest.mark.parametrize("name", ["a+orig.HEAD", "a+orig.BRIK.gz"])
def test_a_pair_is_known_whichever_file_is_named(tmp_path, name):
    head = write(tmp_path, counting((1, 3, 4, 5)), packed=True)
    volume = read(tmp_path / name)
    assert volume.files == (head, tmp_path / "a+orig.BRIK.gz")
    np.testing.assert_array_equal(volume.values, counting((3, 4, 5)))


def test_small_suffixes_are_found_too(tmp_path):
    head = write(tmp_path, counting((1, 3, 4, 5)))
    head.rename(tmp_path / "b.head")
    (tmp_path / "a+orig.BRIK").rename(tmp_path / "b.brik")
    assert read(tmp_path / "b.brik").shape == (5, 4, 3)


def test_a_file_without_its_other_is_refused(tmp_path):
    head = write(tmp_path, counting((1, 3, 4, 5)))
    brick = tmp_path / "a+orig.BRIK"
    content = brick.read_bytes()
    brick.unlink()
    with pytest.raises(VolumeError, match=r"a\+orig\.HEAD \(a\+orig\.BRIK\): cannot be opened"):
        read(head)
    brick.write_bytes(content)
    head.unlink()
    with pytest.raises(VolumeError, match=r"its header a\+orig\.HEAD is not there; put it beside"):
        read(brick)


def test_several_sub_bricks_are_chosen_from(tmp_path):
    with pytest.raises(AmbiguousVolumeError, match="3 sub-bricks found"):
        read(write(tmp_path, counting((3, 3, 4, 5))))


def test_sub_bricks_are_times_where_the_header_has_times(tmp_path):
    values = counting((3, 3, 4, 5), "<i2")
    head = write(tmp_path, values, TAXIS_NUMS=(3, 0, 77002), BRICK_LABS="rest~task~rest again")
    assert_same_as_nibabel(read(head, time="1"), nib.load(head), 1)
    assert_same_as_nibabel(read(head, time="task"), nib.load(head), 1)
    assert list_volumes(str(head), ReadSettings())[0].volumes[1] == "time 1 (task), 5 x 4 x 3"
    head = write(tmp_path, values, BRICK_LABS="mean~t-value~p-value")
    assert list_volumes(str(head), ReadSettings())[0].volumes[1] == "sub-brick 1 (t-value), 5 x 4 x 3"
    with pytest.raises(SettingsError, match="has no such axis"):
        read(head, time="1")


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"IJK_TO_DICOM_REAL": None}, "IJK_TO_DICOM_REAL"),
        ({"BYTEORDER_STRING": None}, "BYTEORDER_STRING"),
        ({"DATASET_DIMENSIONS": (5, 4)}, "sizes"),
        ({"DATASET_DIMENSIONS": (5, 4, -3)}, "sizes"),
        ({"DATASET_RANK": (3, 0)}, "sizes"),
        ({"DATASET_RANK": (3, 10**15)}, "bytes found"),
        ({"DATASET_DIMENSIONS": (50_000, 40_000, 30_000)}, "bytes found"),
        ({"BRICK_TYPES": (2,)}, "data type"),
        ({"BRICK_TYPES": (1, 3)}, "multiple data types"),
        ({"IJK_TO_DICOM_REAL": (1.0,) * 12}, "span the space"),
        ({"IJK_TO_DICOM_REAL": (float("nan"),) * 12}, "IJK_TO_DICOM_REAL|not finite"),
        ({"BRICK_FLOAT_FACS": (float("inf"),)}, "slope inf"),
    ],
    ids=str,
)
def test_headers_that_cannot_be(tmp_path, fields, told):
    with pytest.raises(VolumeError, match=told) as caught:
        read(write(tmp_path, counting((1, 3, 4, 5)), **fields), volume_index=0)
    assert caught.value.exit_status == 3


def test_complex_values_are_refused(tmp_path):
    with pytest.raises(UnsupportedFormatError, match="complex"):
        read(write(tmp_path, np.zeros((1, 3, 4, 5), np.complex128), kind=5))


@pytest.mark.parametrize("packed", [False, True])
def test_values_that_are_cut_short_are_refused(tmp_path, packed):
    path = write(tmp_path, np.random.default_rng(0).integers(0, 999, (1, 9, 9, 9)).astype("<i2"), packed)
    brick = next(tmp_path.glob("*.BRIK*"))
    brick.write_bytes(brick.read_bytes()[:-20])
    with pytest.raises(DamagedVolumeError):
        read(path)


def test_what_is_no_header_is_refused(tmp_path):
    path = write(tmp_path, counting((1, 3, 4, 5)))
    path.write_bytes(bytes(range(256)) * 9)
    with pytest.raises(DamagedVolumeError, match="is no AFNI header that can be understood"):
        read(path)


@pytest.mark.parametrize(("name", "count"), [("scaled+tlrc.HEAD", 1), ("example4d+orig.HEAD", 3)])
def test_nibabels_own_files(name, count):
    path = nibabels_own(name)
    for index in range(count):
        assert_same_as_nibabel(read(path, volume_index=index), nib.load(path), index)


@pytest.mark.parametrize("name", ["bad_attribute+orig.HEAD", "bad_datatype+orig.HEAD"])
def test_nibabels_own_bad_files(tmp_path, name):
    shutil.copy(nibabels_own(name), tmp_path)
    with pytest.raises(DamagedVolumeError, match="no AFNI header that can be understood"):
        read(tmp_path / name)
