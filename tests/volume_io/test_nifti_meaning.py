"""What headers of NIfTI leave open or contradict is told; axes that are not used count for nothing."""

import struct

import nibabel as nib
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so
from hypothesis import given, settings, strategies as st

from dmc_cli.errors import DamagedVolumeError, SettingsError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.cases import case
from tests.volume_io.reading import assert_same_as_nibabel, counting, lps_affine, read, read_with_itk

VALUES = counting((4, 5, 6))
TRIANGLE = ("xx", "xy", "yy", "xz", "yz", "zz")
QFORM = np.array([[0.5, 0, 0, 10], [0, 0.6, 0, 20], [0, 0, 2, 30], [0, 0, 0, 1]])


def write(path, sform=None, qform=None, values=VALUES, unit="mm", dim=None, **fields):
    """A file by nibabel, with numbers of its header as they are given."""
    image = nib.Nifti1Image(values.T, None)
    image.header.set_qform(QFORM if qform is None or qform is False else qform, 1)
    image.header["qform_code"] = 0 if qform is False else 1
    if sform is not None:
        image.header.set_sform(QFORM, 1)
    image.header.set_xyzt_units(unit)
    for key, value in fields.items():
        image.header[key] = value
    nib.save(image, path)
    content = bytearray(path.read_bytes())
    if sform is not None:
        struct.pack_into("<12f", content, 280, *np.asarray(sform, float)[:3].ravel())
    if dim is not None:
        struct.pack_into(f"<{len(dim)}h", content, 40, *dim)
    path.write_bytes(content)
    return path


def codes(volume):
    return [notice.code for notice in volume.warnings]


@pytest.mark.parametrize(
    "dim", [(4, 6, 5, 4, 0), (5, 6, 5, 4, 0, 0), (7, 6, 5, 4, 0, 0, 0, 0), (5, 6, 5, 4, 1, 0)]
)
def test_axes_of_no_node_are_none(tmp_path, dim):
    volume = read(write(tmp_path / "a.nii", dim=dim))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.affine, QFORM, rtol=1e-6)
    assert codes(volume) == []


def test_volumes_beside_an_axis_of_no_node(tmp_path):
    values = counting((3, 4, 5, 6))
    path = write(tmp_path / "a.nii", values=values, dim=(5, 6, 5, 4, 0, 3))
    np.testing.assert_array_equal(read(path, volume_index=2).values, values[2])


@pytest.mark.parametrize(
    ("dim", "told"), [((3, 0, 5, 4), "axes of"), ((3, 6, -5, 4), "axes of"), ((3, 6, 5, 0), "axes of")]
)
def test_axes_of_space_need_nodes(tmp_path, dim, told):
    with pytest.raises(VolumeError, match=told):
        read(write(tmp_path / "a.nii", dim=dim))


@pytest.mark.parametrize("rows", [np.zeros((4, 4)), np.ones((4, 4)), np.diag([1.0, 1, 0, 1])])
def test_a_flat_sform_gives_way_to_a_qform(tmp_path, rows):
    volume = read(write(tmp_path / "a.nii", sform=rows))
    np.testing.assert_allclose(volume.affine, QFORM, rtol=1e-6)
    assert volume.space == "RAS"
    assert codes(volume) == ["W-GEOMETRY-CONTRADICTED"]
    np.testing.assert_allclose(lps_affine(volume), read_with_itk(tmp_path / "a.nii")[1], atol=1e-5)


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_a_sform_that_is_not_finite_is_damaged(tmp_path, number):
    with pytest.raises(DamagedVolumeError, match="not finite"):
        read(write(tmp_path / "a.nii", sform=np.full((4, 4), number)))


def test_a_flat_sform_alone_is_refused(tmp_path):
    with pytest.raises(DamagedVolumeError, match="span the space"):
        read(write(tmp_path / "a.nii", sform=np.zeros((4, 4)), qform=False))


@pytest.mark.parametrize(("factor", "is_told"), [(1.0005, False), (1.002, True), (1 / 0.866, True)])
def test_pixdim_beside_another_sform_is_told(tmp_path, factor, is_told):
    rows = QFORM * [[factor], [1], [1], [1]]
    volume = read(write(tmp_path / "a.nii", sform=rows))
    np.testing.assert_allclose(volume.affine, rows, rtol=1e-6)
    assert codes(volume) == ["W-GEOMETRY-CONTRADICTED"] * is_told


MOVED = np.zeros((4, 4))
MOVED[0, 3] = 3


@pytest.mark.parametrize(
    ("sform", "codes_of", "is_told"),
    [
        (np.diag([-1, 1, 1, 1]) @ QFORM, (1, 1), True),
        (np.diag([-1, 1, 1, 1]) @ QFORM, (4, 1), True),  # no two anatomies are mirror images
        (np.diag([-1, -1, 1, 1]) @ QFORM, (1, 1), True),
        (np.diag([-1, -1, 1, 1]) @ QFORM, (4, 1), False),
        (QFORM + MOVED, (2, 2), True),
        (QFORM + MOVED, (2, 1), False),
        (QFORM + MOVED / 10, (2, 2), False),
    ],
)
def test_a_qform_that_lies_elsewhere_than_the_sform_is_told(tmp_path, sform, codes_of, is_told):
    path = write(tmp_path / "a.nii", sform=sform)
    content = bytearray(path.read_bytes())
    struct.pack_into("<2h", content, 252, codes_of[1], codes_of[0])
    path.write_bytes(content)
    volume = read(path)
    np.testing.assert_allclose(volume.affine, sform, rtol=1e-6)
    assert codes(volume) == ["W-GEOMETRY-CONTRADICTED"] * is_told


def test_a_qform_that_is_none_says_nothing_beside_a_sform(tmp_path):
    path = write(tmp_path / "a.nii", sform=QFORM)
    content = bytearray(path.read_bytes())
    struct.pack_into("<3f", content, 256, 5, 5, 5)
    path.write_bytes(content)
    assert codes(read(path)) == []


@pytest.mark.parametrize(("has_qform", "codes_of"), [(True, []), (False, ["W-ORIENTATION-MISSING"])])
def test_distances_of_zero_are_told(tmp_path, has_qform, codes_of):
    path = write(tmp_path / "a.nii", qform=None if has_qform else False)
    content = bytearray(path.read_bytes())
    struct.pack_into("<2f", content, 80, 0, 0)
    path.write_bytes(content)
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, (1, 1, 2))
    assert sorted(codes(volume)) == sorted([*codes_of, "W-SPACING-MISSING"])
    assert any("no spacing along x and y" in sentence for sentence in volume.sentences)
    assert read(path, spacing=(3, 4, 5)).spacing == pytest.approx((3, 4, 5))


@pytest.mark.parametrize(
    ("unit", "factor", "is_told"),
    [
        ("meter", 1, True),
        ("meter", 1e-3, False),
        ("micron", 1, False),
        ("micron", 1e-3, True),
        ("mm", 1e-7, True),
        ("mm", 1, False),
        ("mm", 100, True),
    ],
)
def test_a_unit_that_fits_no_spacing_is_told(tmp_path, unit, factor, is_told):
    volume = read(write(tmp_path / "a.nii", qform=QFORM * [[factor], [factor], [factor], [1]], unit=unit))
    assert codes(volume) == ["W-UNIT-DOUBTFUL"] * is_told


@pytest.mark.parametrize("has_qform", [True, False])
def test_negative_distances_are_told_and_turn_nothing(tmp_path, has_qform):
    path = write(tmp_path / "a.nii", qform=None if has_qform else False)
    right = read(path)
    content = bytearray(path.read_bytes())
    struct.pack_into("<f", content, 80, -0.5)
    path.write_bytes(content)
    volume = read(path)
    np.testing.assert_array_equal(volume.affine, right.affine)
    assert codes(volume) == [*codes(right), "W-GEOMETRY-CONTRADICTED"]
    assert "-0.5, 0.6, 2" in volume.sentences[-1]


@pytest.mark.parametrize(
    ("slope", "intercept", "scale", "is_told"),
    [
        (2, 3, (2, 3), False),
        (0, 3, (1, 0), False),
        (np.nan, 3, (1, 0), False),
        (np.inf, 3, (1, 0), True),
        (2, np.nan, (2, 0), True),
        (2, np.inf, (2, 0), True),
    ],
)
def test_a_scale_that_is_no_number_is_told(tmp_path, slope, intercept, scale, is_told):
    path = write(tmp_path / "a.nii")
    content = bytearray(path.read_bytes())
    struct.pack_into("<2f", content, 112, slope, intercept)
    path.write_bytes(content)
    volume = read(path)
    assert (volume.slope, volume.intercept) == scale
    assert codes(volume) == ["W-RESCALE-UNKNOWN"] * is_told


@given(st.integers(0, 255), st.integers(0, 6), st.floats(0, 10))
@settings(max_examples=20)
def test_how_slices_were_taken_changes_nothing(tmp_path_factory, dim_info, slice_code, duration):
    path = tmp_path_factory.mktemp("slices") / "a.nii"
    told = {"dim_info": dim_info, "slice_code": slice_code, "slice_duration": duration, "slice_end": 3}
    volume = read(write(path, **told))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.affine, QFORM, rtol=1e-6)
    assert codes(volume) == []


@pytest.mark.parametrize("axes", [(3,), (2, 3), (1, 3), (2, 1)])
def test_times_and_components_are_chosen(tmp_path, axes):
    """dim[4] counts times, dim[5] components; `axes` is slowest first."""
    values = counting((*axes, 4, 5, 6))
    path = write(tmp_path / "a.nii", values=values)
    flat = values.reshape(-1, 4, 5, 6)
    for index in range(len(flat)):
        np.testing.assert_array_equal(read(path, volume_index=index).values, flat[index])
    times = axes[-1]
    chosen = read(path, time=str(times - 1), volume_index=len(flat) // times - 1)
    np.testing.assert_array_equal(chosen.values, flat[-1])
    (entry,) = list_volumes(str(path), ReadSettings())
    assert len(entry.volumes) == len(flat)
    (entry,) = list_volumes(str(path), ReadSettings(time="0"))
    assert len(entry.volumes) == len(flat) // times
    assert ("volumes" in entry.description) == (len(flat) // times > 1)
    with pytest.raises(SettingsError, match="time is '3'"):
        read(path, time="3")


@pytest.mark.parametrize(
    ("intent", "sizes", "labels"),
    [
        (1007, (3, 1), [f"vector component {n} ({part})" for n, part in enumerate("xyz")]),
        (1007, (3,), [f"vector component {n} ({part})" for n, part in enumerate("xyz")]),
        (1007, (2,), ["vector component 0 (x)", "vector component 1 (y)"]),
        (1007, (4,), [f"vector component {n}" for n in range(4)]),
        (1006, (2, 2), ["displacement 0 (x), time 0", "displacement 0 (x), time 1"]),
        (1005, (6, 1), [f"symmetric matrix entry {n} ({part})" for n, part in enumerate(TRIANGLE)]),
        (1004, (2, 1), ["matrix entry 0", "matrix entry 1"]),
        (2003, (3, 1), ["colour 0 (red)", "colour 1 (green)", "colour 2 (blue)"]),
        (2006, (3,), ["displacement 0 (x)", "displacement 1 (y)", "displacement 2 (z)"]),
        (2001, (2,), ["time 0", "time 1"]),
        (0, (2,), ["time 0", "time 1"]),
        (1002, (2,), ["time 0", "time 1"]),
        (0, (2, 1), ["component 0", "component 1"]),
    ],
)
def test_what_the_intent_says_of_the_fourth_and_fifth_axis(tmp_path, intent, sizes, labels):
    """`sizes` are the slowest first."""
    values = counting((*sizes, 4, 5, 6))
    path = write(tmp_path / "a.nii", values=values, intent_code=intent)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes[: len(labels)] == tuple(f"{label}, 6 x 5 x 4" for label in labels)
    np.testing.assert_array_equal(read(path, volume_index=1).values, values.reshape(-1, 4, 5, 6)[1])
    if intent == 1007 and len(sizes) == 1:
        with pytest.raises(SettingsError, match="no such axis"):
            read(path, time="1")


def test_the_name_of_the_intent_is_told(tmp_path):
    path = write(
        tmp_path / "a.nii", values=counting((3, 1, 4, 5, 6)), intent_code=1007, intent_name="velocity"
    )
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes[1] == "vector component 1 (y, velocity), 6 x 5 x 4"


def test_the_vectors_that_itk_writes_are_told(tmp_path):
    image = sitk.GetImageFromArray(np.stack([VALUES, VALUES + 1, VALUES + 2], axis=-1), isVector=True)
    sitk.WriteImage(image, str(tmp_path / "a.nii"))
    np.testing.assert_array_equal(read(tmp_path / "a.nii", volume_index=2).values, VALUES + 2)
    (entry,) = list_volumes(str(tmp_path / "a.nii"), ReadSettings())
    assert entry.volumes[2] == "vector component 2 (z), 6 x 5 x 4"


@pytest.mark.parametrize("name", ["control.nii", "dim4_zero.nii", "dim5_all_zero.nii"])
def test_the_cases_of_zero_dims(name):
    volume = read(case(f"nifti_zero_dim/{name}"))
    assert volume.shape == (32, 28, 24)
    np.testing.assert_allclose(volume.spacing, (0.5, 0.6, 2), rtol=1e-6)
    np.testing.assert_array_equal(volume.values, read(case("nifti_zero_dim/control.nii")).values)
    assert codes(volume) == []


def test_the_cases_of_sforms():
    right = read(case("nifti_sform_bogus/qform_only.nii"))
    volume = read(case("nifti_sform_bogus/sform_zero_qform_good.nii"))
    np.testing.assert_array_equal(volume.affine, right.affine)
    assert codes(volume) == ["W-GEOMETRY-CONTRADICTED"]
    with pytest.raises(DamagedVolumeError):
        read(case("nifti_sform_bogus/sform_nan_qform_good.nii"))
    volume = read(case("nifti_sform_bogus/sform_unit_pixdim_other.nii"))
    np.testing.assert_allclose(volume.spacing, (1, 1, 1))
    assert codes(volume) == ["W-GEOMETRY-CONTRADICTED"]
    assert "0.865759" in volume.warnings[0].sentence


def test_a_sheared_ct():
    path = case("nifti_shear_real/shear.nii.gz")
    volume = read(path)
    assert_same_as_nibabel(volume, nib.load(path))
    assert codes(volume) == []
