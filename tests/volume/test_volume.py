"""A caller's arrays are converted to a volume, or refused with what was found and expected."""

from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.errors import UnsupportedFormatError, VolumeError
from dmc_cli.notices import Notice
from dmc_cli.volume.volume import Volume
from tests.volume_io.reading import counting

VALUES = counting((3, 4, 5), "<i2")


def volume(values=VALUES, **changes):
    return Volume(**{"values": values, "affine": np.diag([2.0, 3.0, 4.0, 1.0]), "space": "RAS", **changes})


CONVERTED = {
    "big-endian integers": (VALUES.astype(">i2"), "i2"),
    "big-endian floats": (VALUES.astype(">f8"), "f8"),
    "truth values": (VALUES % 2 == 1, "u1"),
    "half floats": (VALUES.astype("f2"), "f4"),
    "half floats, big-endian": (VALUES.astype(">f2"), "f4"),
    "Fortran order": (np.asfortranarray(VALUES), "i2"),
    "every other node": (np.repeat(VALUES, 2, axis=2)[:, :, ::2], "i2"),
    "backwards": (VALUES[::-1], "i2"),
    "repeated by a stride of 0": (np.broadcast_to(VALUES[0], (3, 4, 5)), "i2"),
    "not aligned": (np.frombuffer(b"\0" + VALUES.tobytes(), "<i2", offset=1).reshape(3, 4, 5), "i2"),
    "a subclass": (VALUES.view(np.rec.recarray), "i2"),
}


@pytest.mark.parametrize("kind", CONVERTED)
def test_values_are_converted_and_the_array_is_left_alone(kind):
    given, dtype = CONVERTED[kind]
    before, is_writeable = given.copy(), given.flags.writeable
    made = volume(given)
    np.testing.assert_array_equal(made.values, before)
    assert type(made.values) is np.ndarray
    assert made.values.dtype == np.dtype(dtype)
    assert made.values.dtype.isnative
    assert made.values.flags.c_contiguous
    assert made.values.flags.aligned
    assert not made.values.flags.writeable
    np.testing.assert_array_equal(given, before)
    assert given.flags.writeable == is_writeable


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"])
def test_every_type_that_a_volume_holds_is_not_copied(dtype):
    given = VALUES.astype(dtype)
    made = volume(given)
    assert made.values.dtype == given.dtype
    assert np.shares_memory(made.values, given)
    assert given.flags.writeable


@pytest.mark.parametrize("dtype", ["c8", "longdouble", "O", "S4", "U4", "M8[s]", [("a", "i2")]], ids=str)
def test_values_that_are_no_real_numbers_are_refused(dtype):
    with pytest.raises(
        UnsupportedFormatError, match=r"^the volume: values of type .*expected integers.*convert"
    ):
        volume(np.zeros((3, 4, 5), dtype))


@pytest.mark.parametrize(
    "values",
    [VALUES.tolist(), np.ma.masked_less(VALUES, 5), None, 3.0],
    ids=["list", "masked", "None", "number"],
)
def test_what_is_no_array_is_refused(values):
    with pytest.raises(UnsupportedFormatError, match=r"expected a NumPy array"):
        volume(values)


@pytest.mark.parametrize(
    "shape", [(4, 5), (2, 3, 4, 5), (0, 4, 5), (3, 0, 5), (1, 4, 5), (3, 1, 5), (3, 4, 1), ()]
)
def test_anything_but_three_axes_of_two_nodes_is_refused(shape):
    told = " x ".join(map(str, shape[::-1]))
    with pytest.raises(VolumeError, match=rf"^the volume: {told} nodes found"):
        volume(np.zeros(shape))


def test_two_nodes_an_axis_are_enough():
    assert volume(np.zeros((2, 2, 2), "f4")).shape == (2, 2, 2)


def with_entry(row, column, number):
    affine = np.diag([2.0, 3.0, 4.0, 1.0])
    affine[row, column] = number
    return affine


@pytest.mark.parametrize(
    ("affine", "told"),
    [
        (np.eye(3), r"shape \(3, 3\)"),
        (np.eye(4)[:3], r"shape \(3, 4\)"),
        (np.eye(4)[None], r"shape \(1, 4, 4\)"),
        (None, "4 x 4 matrix"),
        ("abc", "no real numbers"),
        (np.ma.masked_equal(np.diag([2.0, 3.0, 4.0, 1.0]), 3), "masked array.*nothing masked"),
        (np.eye(4) * 1j, "no real numbers"),
        (with_entry(3, 3, 2), r"last row \[0.0, 0.0, 0.0, 2.0\]"),
        (with_entry(3, 0, 1), r"last row \[1.0, 0.0, 0.0, 1.0\]"),
        (with_entry(3, 0, np.nan), r"last row \[nan, 0.0, 0.0, 1.0\]"),
        (with_entry(0, 0, np.nan), "not finite"),
        (with_entry(0, 3, np.inf), "not finite"),
        (with_entry(1, 1, 0), "do not span the space"),
        (np.array([[1, 1, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]), "do not span the space"),
        (np.diag([1e200, 1e200, 1e200, 1]), "do not span the space"),
    ],
)
def test_an_affine_that_maps_nothing_is_refused(affine, told):
    with pytest.raises(VolumeError, match=told) as caught:
        volume(affine=affine)
    assert caught.value.exit_status == 3


def test_a_thin_but_proper_affine_is_taken():
    assert volume(affine=np.diag([1e-3, 1e3, -1.0, 1.0])).spacing == (1e-3, 1e3, 1.0)


def test_lists_and_whole_numbers_make_an_affine_too():
    made = volume(affine=[[0, 2, 0, 5], [3, 0, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]])
    assert made.affine.dtype == np.float64
    assert made.spacing == (3.0, 2.0, 4.0)


@pytest.mark.parametrize("space", ["ras", "LPI", "", None, [], np.array(["RAS"])], ids=str)
def test_an_unknown_space_is_refused(space):
    with pytest.raises(VolumeError, match=r"space .* found; expected one of RAS, LPS, none"):
        volume(space=space)


@pytest.mark.parametrize(
    ("slope", "intercept"),
    [
        *[(0, 0), (np.nan, 0), (np.inf, 0), (1, np.nan), (1, -np.inf), (None, 0), (1, "x")],
        *[(1j, 0), (1, 1j), (10**400, 0), (1, 10**400), (True, 0), (np.ones(2), 0)],
    ],
)
def test_slopes_that_lose_the_values_are_refused(slope, intercept):
    with pytest.raises(VolumeError, match=r"slope .*expected .*numbers"):
        volume(slope=slope, intercept=intercept)


@pytest.mark.parametrize(
    "padding",
    [(3, 2), (np.nan, 2), (1,), (1, 2, 3), 5, ("a", 1), "ab", (1, 2j), (0, True), (10**400, 10**401)],
)
def test_padding_that_is_no_range_is_refused(padding):
    with pytest.raises(VolumeError, match=r"padding .*expected"):
        volume(padding=padding)


@pytest.mark.parametrize("padding", [None, (2, 2), (-np.inf, 0)])
def test_padding_that_is_a_range_is_taken(padding):
    assert volume(padding=padding).padding == padding


@pytest.mark.parametrize(
    "positions",
    [
        [0, 1],
        [0, 1, 2, 3],
        [[0, 1, 2]],
        [0, 2, 2],
        [0, 2, 1],
        [1, 2, 3],
        [0, 1, np.nan],
        [0, 1, np.inf],
        "abc",
        ["a", "b", "c"],
        [0, 1e300, 2e300],
        [0, 1, 3.5e38],
        np.ma.masked_equal([0.0, 1.0, 2.0], 1),
    ],
)
def test_slice_positions_that_do_not_rise_from_0_are_refused(positions):
    with pytest.raises(VolumeError, match=r"slice positions"):
        volume(slice_positions=positions)


def test_slices_more_steps_apart_than_float32_holds_are_refused():
    with pytest.raises(VolumeError, match=r"up to 2e\+38 mm found where the affine has steps of 1e-150 mm"):
        volume(affine=np.diag([1e-150] * 3 + [1]), slice_positions=[0, 1, 2e38])


def test_numbers_of_numpy_become_plain_ones():
    made = volume(slope=np.float32(0.1), intercept=np.int16(3), padding=np.array([2**62 + 1, 2**62 + 3]))
    assert (made.slope, made.intercept) == (float(np.float32(0.1)), 3.0)
    assert made.padding == (2**62 + 1, 2**62 + 3)
    assert [type(number) for number in (made.slope, made.intercept, *made.padding)] == [
        float,
        float,
        int,
        int,
    ]


def test_geometry_is_copied():
    affine, positions = np.eye(4), np.array([0.0, 1.0, 3.0])
    made = volume(affine=affine, slice_positions=positions)
    affine[:] = 0
    positions[:] = 0
    np.testing.assert_array_equal(made.affine, np.eye(4))
    np.testing.assert_array_equal(made.slice_positions, [0, 1, 3])


def test_a_changed_volume_is_checked_again_and_not_copied():
    made = volume()
    assert np.shares_memory(replace(made, warnings=(Notice("W-NO-DATA", "a"),)).values, VALUES)
    with pytest.raises(VolumeError, match=r"^scan\.nii: slope 0"):
        replace(made, path="scan.nii", slope=0.0)


@pytest.mark.parametrize(("padding", "expected"), [((0.1, 0.1), (0.1, 0.3)), ((0.05, 0.15), (0.2, 0.3))])
def test_padding_of_floats_is_compared_as_it_is_told(padding, expected):
    """0.1 is no float32: none of them is that."""
    values = np.full((2, 2, 2), 0.2, "f4")
    values[0, 0, 0], values[1, 1, 1] = 0.1, 0.3
    assert volume(values, padding=padding).value_range() == pytest.approx(expected, rel=1e-6)
