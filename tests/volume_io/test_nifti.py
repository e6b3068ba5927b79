import gzip

import nibabel as nib
import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from tests.volume_io.reading import assert_same_as_itk, counting, physical, read

OBLIQUE = np.array([[0.0, -1.5, 0.2, 5], [0.8, 0, 0, -7], [0, 0.3, 2.5, 9], [0, 0, 0, 1]])


def write(path, values, affine=OBLIQUE, kind=nib.Nifti1Image, **fields):
    """Save values [k, j, i] with nibabel, which wants [i, j, k]."""
    image = kind(np.asfortranarray(values.T), affine)
    for key, value in fields.items():
        image.header[key] = value
    nib.save(image, path)
    return path


@pytest.mark.parametrize("dtype", ["u1", "i1", "<i2", ">i2", "<u2", "<i4", "<u4", ">f4", "<f8", "<i8", "<u8"])
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("kind", [nib.Nifti1Image, nib.Nifti2Image])
def test_values_and_affine_survive_every_type_and_order(tmp_path, dtype, suffix, kind):
    values = counting((3, 4, 5), dtype)
    header = kind.header_class(endianness=">" if dtype[0] == ">" else "<")
    header.set_data_dtype(dtype)
    path = tmp_path / f"a{suffix}"
    nib.save(kind(values.T, OBLIQUE, header), path)
    volume = read(path)
    np.testing.assert_array_equal(volume.values, values)
    np.testing.assert_allclose(volume.affine, OBLIQUE, atol=1e-6)
    assert volume.values.dtype == np.dtype(dtype).newbyteorder("=")
    assert volume.space == "RAS"


def test_an_uncompressed_native_file_is_mapped_read_only(tmp_path):
    volume = read(write(tmp_path / "a.nii", counting((3, 4, 5))))
    assert not volume.values.flags.owndata
    assert not volume.values.flags.writeable
    assert volume.values.flags.c_contiguous


def test_the_sform_comes_before_the_qform(tmp_path):
    image = nib.Nifti1Image(counting((3, 4, 5)).T, None)
    image.set_sform(OBLIQUE, 1)
    image.set_qform(np.diag([2, 2, 2, 1]), 1)
    nib.save(image, tmp_path / "a.nii")
    np.testing.assert_allclose(read(tmp_path / "a.nii").affine, OBLIQUE, atol=1e-6)


def test_the_qform_alone_is_used(tmp_path):
    image = nib.Nifti1Image(counting((3, 4, 5)).T, None)
    turned = np.array([[0, -2, 0, 3], [2, 0, 0, 4], [0, 0, -3, 5], [0, 0, 0, 1.0]])
    image.set_qform(turned, 1)
    image.set_sform(None, 0)
    nib.save(image, tmp_path / "a.nii")
    volume = read(tmp_path / "a.nii")
    np.testing.assert_allclose(volume.affine, turned, atol=1e-6)
    assert_same_as_itk(volume, tmp_path / "a.nii")


def test_without_orientation_the_grid_has_its_own_axes_and_a_warning(tmp_path):
    image = nib.Nifti1Image(counting((3, 4, 5)).T, None)
    image.header["pixdim"][1:4] = 0.5, 2, 3
    image.header["sform_code"] = image.header["qform_code"] = 0
    nib.save(image, tmp_path / "a.nii")
    volume = read(tmp_path / "a.nii")
    np.testing.assert_array_equal(volume.affine, np.diag([0.5, 2, 3, 1]))
    assert volume.space == "none"
    assert "no orientation" in volume.sentences[0]


@pytest.mark.parametrize(("unit", "scale"), [("meter", 1000), ("mm", 1), ("micron", 0.001), ("unknown", 1)])
def test_units_of_length_become_millimetres(tmp_path, unit, scale):
    image = nib.Nifti1Image(counting((3, 4, 5)).T, OBLIQUE)
    image.header.set_xyzt_units(unit)
    nib.save(image, tmp_path / "a.nii")
    np.testing.assert_allclose(read(tmp_path / "a.nii").affine[:3], OBLIQUE[:3] * scale, rtol=1e-6)


def test_slope_and_intercept_are_told_and_not_applied(tmp_path):
    path = write(tmp_path / "a.nii", counting((3, 4, 5)))
    content = bytearray(path.read_bytes())
    content[112:120] = np.array([-0.5, 7], "<f4").tobytes()
    path.write_bytes(content)
    volume = read(path)
    assert (volume.slope, volume.intercept) == (-0.5, 7)
    np.testing.assert_array_equal(volume.values, counting((3, 4, 5)))
    np.testing.assert_allclose(physical(volume), nib.load(path).get_fdata().T)


def test_a_pair_is_read_from_either_of_its_files(tmp_path):
    values = counting((3, 4, 5))
    nib.save(nib.Nifti1Pair(values.T, OBLIQUE), tmp_path / "a.hdr")
    for name in ("a.hdr", "a.img"):
        np.testing.assert_array_equal(read(tmp_path / name).values, values)


def test_a_pair_without_its_data_is_refused(tmp_path):
    nib.save(nib.Nifti1Pair(counting((3, 4, 5)).T, OBLIQUE), tmp_path / "a.hdr")
    (tmp_path / "a.img").unlink()
    with pytest.raises(VolumeError, match=r"a\.img"):
        read(tmp_path / "a.hdr")


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_a_volume_of_several_is_chosen_by_its_index(tmp_path, suffix):
    values = counting((6, 3, 4, 5))
    path = write(tmp_path / f"a{suffix}", values)
    with pytest.raises(AmbiguousVolumeError, match=r"6 volumes found.*--volume-index"):
        read(path)
    for index in (0, 4, 5):
        np.testing.assert_array_equal(read(path, volume_index=index).values, values[index])
    with pytest.raises(SettingsError, match="0 to 5"):
        read(path, volume_index=6)


def test_one_volume_along_a_fourth_axis_needs_no_choice(tmp_path):
    assert read(write(tmp_path / "a.nii", counting((1, 3, 4, 5)))).shape == (5, 4, 3)


@pytest.mark.parametrize("dtype", [np.complex64, [("R", "u1"), ("G", "u1"), ("B", "u1")]])
def test_complex_and_colour_values_are_refused(tmp_path, dtype):
    nib.save(nib.Nifti1Image(np.zeros((5, 4, 3), dtype), OBLIQUE), tmp_path / "a.nii")
    with pytest.raises(UnsupportedFormatError, match="values of type"):
        read(tmp_path / "a.nii")


@pytest.mark.parametrize(("code", "told"), [(1, "binary"), (11012, "unknown"), (-1, "unknown")])
def test_other_types_are_refused_by_name_and_code(tmp_path, code, told):
    path = write(tmp_path / "a.nii", counting((3, 4, 5)))
    content = bytearray(path.read_bytes())
    content[70:72] = np.array(code, "<i2").tobytes()
    path.write_bytes(content)
    with pytest.raises(UnsupportedFormatError, match=f"values of type {told}, datatype code {code} found"):
        read(path)


@pytest.mark.parametrize("shape", [(1, 4, 5), (3, 1, 5), (3, 4, 1)])
def test_a_single_layer_is_refused(tmp_path, shape):
    with pytest.raises(VolumeError, match="at least two along each axis") as caught:
        read(write(tmp_path / "a.nii", counting(shape)))
    assert caught.value.exit_status == 3


@pytest.mark.parametrize("kept", [3, 100, 347, 352, 353, 400])
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_a_truncated_file_is_refused(tmp_path, kept, suffix):
    path = write(tmp_path / "a.nii", counting((3, 4, 5)))
    start = path.read_bytes()[:kept]
    cut = tmp_path / f"cut{suffix}"
    cut.write_bytes(gzip.compress(start) if suffix == ".nii.gz" else start)
    with pytest.raises(VolumeError) as caught:
        read(cut)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9])
def test_a_truncated_gzip_stream_is_refused(tmp_path, kept):
    path = write(tmp_path / "a.nii.gz", np.random.default_rng(0).integers(0, 9999, (9, 9, 9)).astype("<i2"))
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * kept)])
    with pytest.raises(DamagedVolumeError, match=r"a\.nii\.gz"):
        read(path)


def test_a_wrong_checksum_is_noticed(tmp_path):
    path = write(tmp_path / "a.nii.gz", counting((3, 4, 5)))
    content = bytearray(path.read_bytes())
    content[-6] ^= 1
    path.write_bytes(content)
    with pytest.raises(DamagedVolumeError, match="damaged"):
        read(path)


def test_a_header_that_promises_a_terabyte_is_refused_at_once(tmp_path):
    path = write(tmp_path / "a.nii.gz", counting((3, 4, 5)))
    content = bytearray(gzip.decompress(path.read_bytes()))
    content[42:48] = np.array([9999, 9999, 9999], "<i2").tobytes()
    path.write_bytes(gzip.compress(content))
    with pytest.raises(DamagedVolumeError, match="bytes found"):
        read(path)


def test_a_flat_affine_is_refused(tmp_path):
    image = nib.Nifti1Image(counting((3, 4, 5)).T, None)
    image.header["sform_code"] = 1
    image.header["srow_x"] = image.header["srow_y"] = image.header["srow_z"] = [1, 2, 3, 4]
    image.header["qform_code"] = 0
    nib.save(image, tmp_path / "a.nii")
    with pytest.raises(DamagedVolumeError, match="span the space"):
        read(tmp_path / "a.nii")


@given(
    shape=st.tuples(*[st.integers(2, 7)] * 3),
    seed=st.integers(0, 99),
    dtype=st.sampled_from(["u1", "<i2", ">f4", "<f8"]),
)
def test_what_nibabel_writes_is_read_back(tmp_path_factory, shape, seed, dtype):
    draws = np.random.default_rng(seed)
    values = (draws.random(shape) * 200).astype(dtype)
    affine = np.eye(4)
    affine[:3] = draws.normal(size=(3, 4))
    path = write(tmp_path_factory.mktemp("nifti") / "a.nii.gz", values, affine)
    volume = read(path)
    np.testing.assert_array_equal(volume.values, values)
    np.testing.assert_allclose(volume.affine, affine, atol=1e-6)


REAL = [
    "nifti_mni_endian/air.hdr.gz",
    "nifti_mni_endian/air.img.gz",
    "nifti_mni_endian/avg152T1_LR_nifti.nii",
    "nifti_mni_endian/big.nii.gz",
    "nifti_mni_endian/little.nii.gz",
    "nifti_mr_seg3d/MR.nii.gz",
    "nifti_small_odd/KmeansTest_T1UCharRaw.nii.gz",
    "nifti_small_odd/anatomical.nii",
    "nifti_small_odd/scct.nii",
    "nifti_small_odd/t1w.nii.gz",
    "nifti_small_odd/t2.nii.gz",
    "nifti_stroke_t1/T1.nii.gz",
]


@pytest.mark.parametrize("name", REAL)
def test_real_files_agree_with_simpleitk(shared_data, name):
    assert_same_as_itk(read(shared_data / name), shared_data / name)


@pytest.mark.parametrize("name", ["functional.nii", "example4d.nii.gz", "example_nifti2.nii.gz"])
def test_real_4d_files_agree_with_nibabel(shared_data, name):
    path = shared_data / "nifti_small_odd" / name
    image = nib.load(path)
    volume = read(path, volume_index=1)
    np.testing.assert_allclose(physical(volume), image.get_fdata()[..., 1].T, rtol=1e-6)
    np.testing.assert_allclose(volume.affine, image.affine, atol=1e-5)


def test_both_versions_hold_the_same_brain(shared_data):
    one = read(shared_data / "nifti_mni_endian/avg152T1_LR_nifti.nii")
    two = read(shared_data / "nifti_mni_endian/avg152T1_LR_nifti2.nii.gz")
    assert np.corrcoef(one.values.ravel(), two.values.ravel())[0, 1] > 0.99
    assert np.linalg.det(one.affine) < 0


def test_a_file_that_is_no_nifti_is_refused(shared_data):
    with pytest.raises(UnsupportedFormatError, match="no NIfTI header"):
        read(shared_data / "nifti_mni_endian/not-nifti.nii")


@pytest.mark.parametrize("kind", [nib.Nifti1Image, nib.Nifti2Image])
@pytest.mark.parametrize("order", "<>")
@given(seed=st.integers(0, 999))
def test_any_qform_is_read_as_nibabel_reads_it(tmp_path_factory, kind, order, seed):
    draws = np.random.default_rng(seed)
    turned = np.linalg.qr(draws.normal(size=(3, 3)))[0] * draws.uniform(0.3, 4, 3)
    affine = np.eye(4)
    affine[:3] = np.column_stack((turned, draws.normal(size=3)))
    image = kind(counting((3, 4, 5)).T, None, kind.header_class(endianness=order))
    image.set_qform(affine, 1)
    path = tmp_path_factory.mktemp("nifti") / "a.nii"
    nib.save(image, path)
    header = nib.load(path).header
    rest = 1 - sum(float(header[f"quatern_{axis}"]) ** 2 for axis in "bcd")
    assume(not 1e-7 <= rest <= 4e-7)  # a half turn to nibabel, not to nifti1_io.c
    np.testing.assert_allclose(read(path).affine, nib.load(path).affine, atol=1e-5)


@pytest.mark.parametrize("axis", [(1, 1, 1), (1, 5, 7), (1, 2, 2)])
def test_a_half_turn_is_one_in_spite_of_rounding(tmp_path, axis):
    """Of the first two, rounded to float32, the squares leave 4e-8 of 1; the last one's are more than 1."""
    image = nib.Nifti1Image(counting((3, 4, 5)).T, None)
    image.set_qform(np.diag([1.0, 2, 3, 1]), 1)
    nib.save(image, tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    axis = np.array(axis) / np.linalg.norm(axis)
    content[256:268] = axis.astype("<f4").tobytes()
    (tmp_path / "a.nii").write_bytes(content)
    turned = (2 * np.outer(axis, axis) - np.eye(3)) * (1, 2, 3)
    volume = read(tmp_path / "a.nii")
    np.testing.assert_allclose(volume.affine[:3, :3], turned, atol=1e-6)
    assert_same_as_itk(volume, tmp_path / "a.nii")


@pytest.mark.parametrize("form", ["qform_code", None])
def test_a_header_without_qfac_and_spacing_counts_them_as_one(tmp_path, form):
    """As nifti1_io.c does: pixdim is all zeros in what some programs write."""
    image = nib.Nifti1Image(counting((3, 4, 5)).T, None)
    nib.save(image, tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    content[76:92] = np.zeros(4, "<f4").tobytes()
    content[252:256] = np.array([form is not None, 0], "<i2").tobytes()
    content[256:280] = np.array([0, 0, 0, 7, 8, 9], "<f4").tobytes()
    (tmp_path / "a.nii").write_bytes(content)
    volume = read(tmp_path / "a.nii")
    np.testing.assert_array_equal(volume.affine[:3, :3], np.eye(3))
    if form:
        assert_same_as_itk(volume, tmp_path / "a.nii")


@pytest.mark.parametrize(("place", "number"), [(80, np.nan), (256, 1.5), (256, np.inf), (268, np.nan)])
def test_an_impossible_qform_is_refused(tmp_path, place, number):
    image = nib.Nifti1Image(counting((3, 4, 5)).T, None)
    image.set_qform(np.eye(4), 1)
    nib.save(image, tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    content[place : place + 4] = np.array(number, "<f4").tobytes()
    (tmp_path / "a.nii").write_bytes(content)
    with pytest.raises(DamagedVolumeError, match=r"qform|geometry is not finite"):
        read(tmp_path / "a.nii")
