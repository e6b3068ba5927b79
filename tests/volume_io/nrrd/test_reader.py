import bz2
import gzip

import nrrd
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from tests.volume_io.reading import assert_same_as_itk, counting, lps_affine, read

VALUES = counting((4, 3, 2))
LPS = "space: left-posterior-superior\nspace directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (7,8,9)\n"


def header(sizes="2 3 4", encoding="raw", kind="short", extra="", endian="little"):
    dimension = len(sizes.split())
    return (
        f"NRRD0005\n# a comment\ntype: {kind}\ndimension: {dimension}\nsizes: {sizes}\n"
        f"encoding: {encoding}\nendian: {endian}\n{extra}"
    )


def write(path, text, data=b""):
    path.write_bytes(text.encode() + b"\n" + data)
    return path


ENCODED = {
    "raw": bytes,
    "gzip": gzip.compress,
    "gz": gzip.compress,
    "bzip2": bz2.compress,
    "bz2": bz2.compress,
    "hex": lambda data: data.hex("\n", 8).encode(),
    "ascii": lambda data: " ".join(str(v) for v in np.frombuffer(data, "<i2")).encode(),
    "txt": lambda data: "\n".join(str(v) for v in np.frombuffer(data, "<i2")).encode(),
}


@pytest.mark.parametrize("encoding", ENCODED)
@pytest.mark.parametrize("detached", [False, True])
def test_every_encoding_attached_and_detached(tmp_path, encoding, detached):
    data = ENCODED[encoding](VALUES.tobytes())
    if detached:
        (tmp_path / "values").write_bytes(data)
        path = write(tmp_path / "a.nhdr", header(encoding=encoding, extra=LPS + "data file: values\n"))
    else:
        path = write(tmp_path / "a.nrrd", header(encoding=encoding, extra=LPS), data)
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_array_equal(volume.affine, [[2, 0, 0, 7], [0, 3, 0, 8], [0, 0, 4, 9], [0, 0, 0, 1]])
    assert volume.space == "LPS"


@pytest.mark.parametrize(
    ("kind", "dtype"),
    [
        ("signed char", "i1"),
        ("uchar", "u1"),
        ("short int", "i2"),
        ("uint16_t", "u2"),
        ("int", "i4"),
        ("unsigned int", "u4"),
        ("long long", "i8"),
        ("unsigned long long int", "u8"),
        ("float", "f4"),
        ("double", "f8"),
    ],
)
@pytest.mark.parametrize("endian", ["little", "big"])
def test_every_type_in_both_byte_orders(tmp_path, kind, dtype, endian):
    values = counting((4, 3, 2), ("<" if endian == "little" else ">") + dtype)
    volume = read(write(tmp_path / "a.nrrd", header(kind=kind, endian=endian), values.tobytes()))
    np.testing.assert_array_equal(volume.values, values)
    assert volume.values.dtype == np.dtype(dtype)


def test_a_detached_raw_file_is_mapped(tmp_path):
    (tmp_path / "values").write_bytes(VALUES.tobytes())
    volume = read(write(tmp_path / "a.nhdr", header(extra="data file: values\n")))
    assert not volume.values.flags.owndata


@pytest.mark.parametrize(
    ("spelled", "space", "signs"),
    [
        ("left-posterior-superior", "LPS", (1, 1, 1)),
        ("LPS", "LPS", (1, 1, 1)),
        ("right-anterior-superior", "RAS", (1, 1, 1)),
        ("RAS", "RAS", (1, 1, 1)),
        ("left-anterior-superior", "RAS", (-1, 1, 1)),
        ("LAS", "RAS", (-1, 1, 1)),
        ("scanner-xyz", "none", (1, 1, 1)),
        ("3D-right-handed", "none", (1, 1, 1)),
        ("3D-left-handed", "none", (1, 1, 1)),
    ],
)
def test_every_space_becomes_ras_lps_or_none(tmp_path, spelled, space, signs):
    text = header(
        extra=f"space: {spelled}\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (4,5,6)\n"
    )
    volume = read(write(tmp_path / "a.nrrd", text, VALUES.tobytes()))
    assert volume.space == space
    expected = np.array([[1, 0, 0, 4], [0, 2, 0, 5], [0, 0, 3, 6]]) * np.array(signs)[:, None]
    np.testing.assert_array_equal(volume.affine[:3], expected)


def test_space_units_become_millimetres(tmp_path):
    text = header(extra=LPS + 'space units: "m" "um" "mm"\n')
    volume = read(write(tmp_path / "a.nrrd", text, VALUES.tobytes()))
    np.testing.assert_allclose(volume.affine[:3, 3], [7000, 0.008, 9])
    np.testing.assert_allclose(volume.spacing, [2000, 0.003, 4])


@pytest.mark.parametrize(
    ("units", "lengths"), [("mm", (2, 3, 4)), ('"cm"', (20, 3, 4)), ('"mm" "mm" "cm" "s"', (2, 3, 40))]
)
def test_each_axis_of_space_has_its_unit_or_none(tmp_path, units, lengths):
    text = header(extra=LPS + f"space units: {units}\n")
    assert read(write(tmp_path / "a.nrrd", text, VALUES.tobytes())).spacing == lengths


UNITS = [("m", 1e3), ("meter", 1e3), ("metre", 1e3), ("cm", 10), ("mm", 1), ("millimeter", 1)]
UNITS += [("millimetre", 1), ("um", 1e-3), ("\u00b5m", 1e-3), ("\u03bcm", 1e-3), ("micron", 1e-3)]
UNITS += [("Microns", 1e-3), ("micrometer", 1e-3), ("micrometre", 1e-3), ("nm", 1e-6), ("???", 1), ("", 1)]
UNITS += [("inch", 25.4), ("\u00c5", 1e-7), ("pm", 1e-9)]


@pytest.mark.parametrize(("unit", "length"), UNITS)
def test_every_unit_of_length(tmp_path, unit, length):
    text = header(extra=f'spacings: 2 3 4\nunits: "mm" "{unit}" "mm"\n')
    volume = read(write(tmp_path / "a.nrrd", text, VALUES.tobytes()))
    assert volume.spacing == (2, 3 * length, 4)
    assert [notice.code for notice in volume.warnings] == ["W-UNIT-MISSING"] * (unit in ("???", ""))


DIRECTIONS = "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"


@pytest.mark.parametrize(
    ("extra", "told"),
    [
        (
            'space: 3D-left-handed\nspace units: "mm" "mm" "mm"\n' + DIRECTIONS,
            "the header's space is left-handed: in a right-handed viewer",
        ),
        ("space: 3D-left-handed\nspacings: 1 1 1\nunits: mm mm mm\n", "the header's space is left-handed"),
        ("space: 3D-right-handed\nspace units: mm mm mm\n" + DIRECTIONS, None),
        ("space: 3D-right-handed\n" + DIRECTIONS, "the header tells no unit of length; taken as milli"),
        ("space: scanner-xyz\nspacings: 1 1 1\n", None),
        ("space: RAS\nspacings: 1 1 1\n", "the header names the space ras but no directions; axes are"),
        ("space: RAS\n" + DIRECTIONS, None),
        ("spacings: 1 1 1\nunits: mm mm mm\n", None),
        ("spacings: 1 1 1\n", "the header tells no unit of length; taken as millimetres; --spacing"),
        ("spacings: 1 1 1\nunits: mm mm\n", "the header tells no unit of length along z; taken as milli"),
        (
            "spacings: 1 nan 1\nunits: mm mm mm\n",
            "the header tells no spacing along y; 1 mm is taken; --sp",
        ),
        (
            'space: RAS\nspace units: "ell" "mm" "mm"\n' + DIRECTIONS,
            "the header's unit of length 'ell' is un",
        ),
        ('spacings: 1 1 1\nunits: "mm" "ell" "mm"\n', "the header's unit of length 'ell' is unknown; taken"),
    ],
)
def test_what_a_header_leaves_open_is_told(tmp_path, extra, told):
    warnings = read(write(tmp_path / "a.nrrd", header(extra=extra), VALUES.tobytes())).sentences
    assert [warning[: len(told or "")] for warning in warnings] == ([told] if told else [])


def test_a_field_that_is_repeated_counts_once(tmp_path):
    text = header(extra="spacings: 2 3 4\nspacings: 5 6 7\n")
    assert read(write(tmp_path / "a.nrrd", text, VALUES.tobytes())).spacing == (2, 3, 4)


def test_spacings_without_a_space(tmp_path):
    text = header(extra="spacings: 0.5 2 3\naxis mins: 10 nan nan\n")
    volume = read(write(tmp_path / "a.nrrd", text, VALUES.tobytes()))
    np.testing.assert_array_equal(volume.affine, [[0.5, 0, 0, 10], [0, 2, 0, 0], [0, 0, 3, 0], [0, 0, 0, 1]])
    assert volume.space == "none"


def test_lists_and_patterns_of_slices(tmp_path):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k + 1:03d}.raw").write_bytes(b"HEAD" + plane.tobytes())
    files = "".join(f"s{k:03d}.raw\n" for k in (1, 2, 3, 4))
    (tmp_path / "list.nhdr").write_text(header(extra="byte skip: 4\ndata file: LIST\n") + files)
    pattern = write(tmp_path / "pattern.nhdr", header(extra="byte skip: 4\ndata file: s%03d.raw 1 4 1\n"))
    backwards = write(tmp_path / "back.nhdr", header(extra="byte skip: -1\ndata file: s%03d.raw 4 1 -1\n"))
    np.testing.assert_array_equal(read(tmp_path / "list.nhdr").values, VALUES)
    np.testing.assert_array_equal(read(pattern).values, VALUES)
    np.testing.assert_array_equal(read(backwards).values, VALUES[::-1])
    (tmp_path / "s003.raw").unlink()
    with pytest.raises(VolumeError, match=r"s003\.raw"):
        read(pattern)


@pytest.mark.parametrize(
    ("extra", "front", "encoding"),
    [
        ("byte skip: 5\n", b"12345", "raw"),
        ("line skip: 2\n", b"one\ntwo\n", "raw"),
        ("line skip: 1\nbyte skip: 3\n", b"one\n123", "raw"),
        ("byte skip: -1\n", b"whatever stands here", "raw"),
        ("line skip: 1\n", b"one\n", "gzip"),
        ("line skip: 1\nbyte skip: 4\n", b"one\n", "gzip"),
    ],
)
def test_bytes_and_lines_are_skipped(tmp_path, extra, front, encoding):
    inner = b"JUNK" if encoding == "gzip" and "byte" in extra else b""
    data = front + ENCODED[encoding](inner + VALUES.tobytes())
    (tmp_path / "values").write_bytes(data)
    path = write(tmp_path / "a.nhdr", header(encoding=encoding, extra=extra + "data file: values\n"))
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_gzip_of_several_members_and_trailing_bytes(tmp_path):
    data = VALUES.tobytes()
    packed = gzip.compress(data[:10]) + gzip.compress(data[10:]) + b"\0\0trailing"
    np.testing.assert_array_equal(
        read(write(tmp_path / "a.nrrd", header(encoding="gzip"), packed)).values, VALUES
    )


def test_windows_line_ends_and_key_value_pairs(tmp_path):
    text = header(extra=LPS + "Segment0_Name:=bone\nkinds: domain domain domain\n").replace("\n", "\r\n")
    (tmp_path / "a.nrrd").write_bytes(text.encode() + b"\r\n" + VALUES.tobytes())
    np.testing.assert_array_equal(read(tmp_path / "a.nrrd").values, VALUES)


@pytest.mark.parametrize(
    "extra",
    [
        "kinds: list domain domain domain\n",
        "space: RAS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n",
    ],
)
def test_a_component_is_chosen_by_its_index(tmp_path, extra):
    values = counting((4, 3, 2, 5))
    path = write(tmp_path / "a.nrrd", header(sizes="5 2 3 4", extra=extra), values.tobytes())
    with pytest.raises(AmbiguousVolumeError, match="--volume-index"):
        read(path)
    np.testing.assert_array_equal(read(path, volume_index=3).values, values[..., 3])


@pytest.mark.parametrize(
    "extra",
    [
        "kinds: domain domain domain time\n",
        "space: RAST\nspace directions: (1,0,0,0) (0,1,0,0) (0,0,1,0) (0,0,0,1)\nspace origin: (0,0,0,0)\n",
        "",
    ],
)
def test_a_time_point_is_chosen_by_its_index(tmp_path, extra):
    values = counting((5, 4, 3, 2))
    path = write(tmp_path / "a.nrrd", header(sizes="2 3 4 5", extra=extra), values.tobytes())
    np.testing.assert_array_equal(read(path, volume_index=3).values, values[3])


def test_a_component_of_vectors_is_to_be_chosen(tmp_path):
    path = write(
        tmp_path / "a.nrrd", header(sizes="3 2 3 4", extra="kinds: 3-vector space space space\n"), bytes(144)
    )
    with pytest.raises(AmbiguousVolumeError, match=r"every node holds 3 numbers.*--volume-index N"):
        read(path)


@pytest.mark.parametrize(
    ("text", "error", "told"),
    [
        ("NRRD0004\ntype: short\n", DamagedVolumeError, "no field 'dimension'"),
        (header(kind="block"), UnsupportedFormatError, "type 'block'"),
        (header(encoding="zrl"), UnsupportedFormatError, "encoding 'zrl'"),
        (header(sizes="2 3 -4"), DamagedVolumeError, "positive"),
        (header(sizes="2 3 x"), DamagedVolumeError, "expected numbers"),
        (header(sizes="200000 300000 400000"), DamagedVolumeError, "bytes found"),
        (header(sizes="200000 300000 400000", encoding="gzip"), DamagedVolumeError, "bytes found"),
        (header(extra="byte skip: x\n"), DamagedVolumeError, "byte skip"),
        (header(extra="data file: nowhere.raw\n"), VolumeError, "nowhere.raw"),
        (
            header(extra="space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,0)\n"),
            DamagedVolumeError,
            "span the space",
        ),
        (
            header(extra="space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,nan)\n"),
            DamagedVolumeError,
            "finite",
        ),
        (
            header(extra="space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,q)\n"),
            DamagedVolumeError,
            "vector",
        ),
        ("not a NRRD\n", UnsupportedFormatError, "NRRD000"),
        (header(encoding="gzip"), DamagedVolumeError, "damaged|bytes"),
    ],
)
def test_damaged_headers_are_refused(tmp_path, text, error, told):
    with pytest.raises(error, match=told):
        read(write(tmp_path / "a.nrrd", text, VALUES.tobytes()))


@pytest.mark.parametrize("encoding", ENCODED)
def test_truncated_values_are_refused(tmp_path, encoding):
    data = ENCODED[encoding](VALUES.tobytes())
    path = write(tmp_path / "a.nrrd", header(encoding=encoding), data[: len(data) * 2 // 3])
    with pytest.raises(DamagedVolumeError, match=r"a\.nrrd"):
        read(path)


@given(
    shape=st.tuples(*[st.integers(2, 7)] * 3),
    seed=st.integers(0, 99),
    encoding=st.sampled_from(["raw", "gzip", "bzip2", "ascii"]),
    dtype=st.sampled_from(["u1", "<i2", ">i2", "<f4", "<f8"]),
)
def test_what_pynrrd_writes_is_read_back(tmp_path_factory, shape, seed, encoding, dtype):
    draws = np.random.default_rng(seed)
    values = np.round(draws.random(shape) * 200, 2).astype(dtype)
    directions, origin = draws.normal(size=(3, 3)), draws.normal(size=3)
    path = tmp_path_factory.mktemp("nrrd") / "a.nrrd"
    fields = {"encoding": encoding, "space": "RAS", "space directions": directions, "space origin": origin}
    nrrd.write(str(path), values, fields, index_order="C")
    volume = read(path)
    np.testing.assert_allclose(volume.values, values, rtol=1e-6)
    np.testing.assert_allclose(volume.affine[:3, :3], directions.T)
    np.testing.assert_allclose(volume.affine[:3, 3], origin)


REAL = [
    "nrrd_avf_mra/avf_float_32.nrrd",
    "nrrd_brain1/brain1_image.nrrd",
    "nrrd_brain1/brain1_label.nrrd",
    "nrrd_breast1/breast1_image.nrrd",
    "nrrd_encodings_tiny/BallBinary30x30x30.nhdr",
    "nrrd_encodings_tiny/BallBinary30x30x30_gz_lineskip.nrrd",
    "nrrd_encodings_tiny/vol-ascii.nhdr",
    "nrrd_encodings_tiny/vol-gzip-big.nhdr",
    "nrrd_encodings_tiny/vol-raw-big.nrrd",
    "nrrd_fetal_t2/template_T2.nrrd",
    "nrrd_skull_mask/Skull.nrrd",
    "nrrd_tooth/tooth.nhdr",
    "raw_headmr_meta/HeadMRVolumeWithDirection.nhdr",
]


@pytest.mark.parametrize("name", REAL)
def test_real_files_agree_with_simpleitk(shared_data, name):
    assert_same_as_itk(read(shared_data / name), shared_data / name)


def test_bzip2_agrees_with_pynrrd(shared_data):
    path = shared_data / "nrrd_encodings_tiny/BallBinary30x30x30_bz2.nrrd"
    np.testing.assert_array_equal(read(path).values, nrrd.read(str(path), index_order="C")[0])


def test_one_scan_as_nrrd_and_nifti_agrees_in_the_world(shared_data):
    one = read(shared_data / "nrrd_avf_mra/avf_float_32.nrrd")
    two = read(shared_data / "nrrd_avf_mra/avf_float_32.nii.gz")
    assert (one.space, two.space) == ("LPS", "RAS")
    one_to_two = np.round(np.linalg.inv(lps_affine(two)) @ lps_affine(one)).astype(int)
    k, j, i = np.indices(one.values.shape).reshape(3, -1)
    x, y, z, _ = one_to_two @ np.array([i, j, k, np.ones_like(i)])
    np.testing.assert_array_equal(one.values.ravel(), two.values[z, y, x])
    np.testing.assert_allclose(lps_affine(two) @ one_to_two, lps_affine(one), atol=1e-4)


def test_a_folder_of_raw_slices_with_a_pattern(shared_data):
    folder = shared_data / "raw_headsq_slices"
    volume = read(folder / "quarter.nhdr")
    assert volume.shape == (64, 64, 93)
    np.testing.assert_allclose(volume.spacing, (3.2, 3.2, 1.5))
    np.testing.assert_array_equal(volume.values[41].ravel(), np.fromfile(folder / "quarter.42", "<i2"))
    assert len(volume.files) == 93


@pytest.mark.parametrize("name", ["mini-ten-mask.nrrd", "mini-vector-fast.nrrd"])
def test_a_component_of_real_tensors_and_vectors_is_to_be_chosen(shared_data, name):
    with pytest.raises(AmbiguousVolumeError, match=r"every node holds.*--volume-index N"):
        read(shared_data / "nrrd_encodings_tiny" / name)


def test_a_left_handed_space_is_told_by_its_code(tmp_path):
    extra = "space: 3D-left-handed\nspacings: 1 1 1\nunits: mm mm mm\n"
    volume = read(write(tmp_path / "a.nrrd", header(extra=extra), VALUES.tobytes()))
    assert [notice.code for notice in volume.warnings] == ["W-SPACE-LEFT-HANDED"]
