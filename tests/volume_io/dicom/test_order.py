"""Series without positions are read in the order that the user asks for; directions are of length 1."""

import numpy as np
import pytest
from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, SettingsError, VolumeError
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import physical, read, read_with_itk

NOWHERE = {"ImagePositionPatient": None, "ImageOrientationPatient": None}
SPACING = (0.75, 0.5, 2.0)


def texts(volume):
    """The sentences of a volume's warnings."""
    return " | ".join(getattr(told, "sentence", told) for told in volume.warnings)


def unplaced(folder, count=12, **elements):
    """Slices whose names, numbers and locations give three orders."""
    for k in range(count):
        numbers = {"InstanceNumber": str(count - k), "SliceLocation": str(3 * k % count * 2.0)}
        save(make_slice((0, 0, 0), k, **{**NOWHERE, **numbers, **elements}), folder / f"IM{k + 1}")
    return folder


ORDERS = {
    "instance": list(range(11, -1, -1)),
    "location": sorted(range(11), key=lambda k: 3 * k % 11),
    "filename": list(range(12)),
}


@pytest.mark.parametrize("order", ORDERS)
def test_slices_follow_each_other_as_asked(tmp_path, order):
    expected = ORDERS[order]
    volume = read(unplaced(tmp_path, len(expected)), slice_order=order, spacing=SPACING)
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in expected])
    np.testing.assert_array_equal(volume.affine, np.diag([*SPACING, 1]))
    assert volume.space == "none"
    assert f"by {order} at the distances of --spacing" in texts(volume)


def test_what_contradicts_the_given_spacing_is_told(tmp_path):
    folder = unplaced(tmp_path, 4)
    told = texts(read(folder, slice_order="filename", spacing=(1, 1, 1)))
    assert "pixels of 1 x 1 mm, the file of 0.75 x 0.5 mm" in told
    assert "SliceLocation has 2 mm" in texts(read(folder, slice_order="location", spacing=(0.75, 0.5, 3)))


def test_without_an_order_the_options_are_named(tmp_path):
    with pytest.raises(VolumeError, match=r"no position or orientation.*--slice-order instance.*--spacing"):
        read(unplaced(tmp_path))


def test_echoes_are_not_put_one_on_the_other(tmp_path):
    for k in range(6):
        for n, echo in enumerate(("5", "50")):
            dataset = make_slice((0, 0, 0), k, **NOWHERE, EchoTime=echo, values=plane_values(k + 10 * n))
            dataset.InstanceNumber = str(2 * k + n)
            save(dataset, tmp_path / f"{k}{n}")
    with pytest.raises(AmbiguousVolumeError, match=r"(?s)echo time 5 ms.*echo time 50 ms"):
        read(tmp_path, slice_order="instance", spacing=SPACING)
    volume = read(tmp_path, slice_order="instance", spacing=SPACING, series="2")
    np.testing.assert_array_equal(volume.values, [plane_values(k + 10) for k in range(6)])


@pytest.mark.parametrize(
    ("order", "element"), [("instance", "InstanceNumber"), ("location", "SliceLocation")]
)
def test_numbers_that_are_left_out_are_missing_slices(tmp_path, order, element):
    for k in (1, 2, 3, 6, 7):
        save(make_slice((0, 0, 0), k, **{**NOWHERE, element: str(3 * k)}), tmp_path / str(k))
    with pytest.raises(AmbiguousVolumeError, match=r"2 missing slices found: 6\.000 mm between 3 and 6"):
        read(tmp_path, slice_order=order, spacing=SPACING)
    volume = read(tmp_path, slice_order=order, spacing=SPACING, slice_gaps="keep")
    np.testing.assert_array_equal(volume.slice_positions, [0, 2, 4, 10, 12])
    assert read(tmp_path, slice_order="filename", spacing=SPACING).slice_positions is None


@pytest.mark.parametrize("numbers", [(1, 3, 4.5, 9), (1, 2, 4.6, 5.6)])
def test_locations_that_are_no_whole_steps_apart_tell_of_none_that_is_missing(tmp_path, numbers):
    for k, number in enumerate(numbers):
        save(make_slice((0, 0, 0), k, **{**NOWHERE, "SliceLocation": str(number)}), tmp_path / str(k))
    assert read(tmp_path, slice_order="location", spacing=SPACING).spacing == SPACING


def test_an_order_needs_distances(tmp_path):
    with pytest.raises(SettingsError, match=r"slice_order is 'instance'.*--spacing X,Y,Z"):
        read(unplaced(tmp_path), slice_order="instance")


def test_an_order_that_slices_do_not_have_is_refused(tmp_path):
    folder = unplaced(tmp_path, SliceLocation=None, InstanceNumber="7")
    with pytest.raises(VolumeError, match=r"IM1 has no SliceLocation"):
        read(folder, slice_order="location", spacing=SPACING)
    with pytest.raises(AmbiguousVolumeError, match=r"the same instance"):
        read(folder, slice_order="instance", spacing=SPACING)


def test_spacing_has_no_effect_on_slices_that_tell_theirs(tmp_path):
    volume = read(save_stack(tmp_path, axial()), spacing=(9, 9, 9))
    assert volume.spacing == (0.75, 0.5, 2)
    assert "--spacing has no effect" in texts(volume)


def test_spacing_is_for_slices_that_tell_positions_but_no_pixels(tmp_path):
    save_stack(tmp_path, axial(), PixelSpacing=None, ImagerPixelSpacing=[0.4, 0.4])
    with pytest.raises(VolumeError, match=r"no pixel spacing, only ImagerPixelSpacing 0\.4 mm"):
        read(tmp_path)
    volume = read(tmp_path, spacing=(0.75, 0.5, 9))
    assert (volume.spacing, volume.space) == ((0.75, 0.5, 2), "LPS")
    told = [(notice.code, notice.sentence) for notice in volume.warnings]
    assert [code for code, _ in told] == ["W-OPTION-UNUSED"]
    assert "slices at 9 mm, their positions 2 mm" in told[0][1]
    assert read(tmp_path, spacing=(0.75, 0.5, 2)).warnings == ()


def test_other_distances_than_those_of_frames_without_positions_are_told(cases):
    path = cases / "cine_time" / "cbct_multiframe_ct.dcm"  # 0.3 mm along each axis
    volume = read(path, spacing=(1, 0.3, 3))
    told = {
        notice.code: [n.sentence for n in volume.warnings if n.code == notice.code]
        for notice in volume.warnings
    }
    assert (volume.spacing, set(told)) == ((1, 0.3, 3), {"W-POSITION-MISSING", "W-OPTION-PREFERRED"})
    assert told["W-OPTION-PREFERRED"] == [
        "--spacing has pixels of 1 x 0.3 mm, the file of 0.3 x 0.3 mm",
        "--spacing has slices at 3 mm, the file 0.3 mm",
    ]
    assert len(read(path, spacing=(0.3, 0.3, 0.3)).warnings) == 1


@pytest.mark.parametrize(
    ("cosines", "rounded"),
    [
        ((0.71, 0.71, 0, 0, 0, -1), True),
        ((0.6, 0.8, 0.02, 0.8, -0.6, 0.02), True),
        ((0.6, 0.8, 0, 0, 0, -1), False),
        ((0.999848, 0.017452, 0, -0.017452, 0.999848, 0), False),
    ],
)
def test_directions_have_length_1_whatever_their_rounding(tmp_path, cosines, rounded):
    normal = np.cross(cosines[:3], cosines[3:])
    positions = [np.round(2.0 * k * normal, 6) for k in range(4)]
    volume = read(save_stack(tmp_path, positions, orientation=cosines))
    x, y = volume.affine[:3, 0], volume.affine[:3, 1]
    assert np.linalg.norm(x) == pytest.approx(0.75, rel=1e-12)
    assert np.linalg.norm(y) == pytest.approx(0.5, rel=1e-12)
    assert abs(x @ y) < 1e-12
    assert ("direction cosines" in texts(volume)) == rounded
    assert ("W-ORIENTATION-ROUNDED" in [notice.code for notice in volume.warnings]) == rounded


@pytest.mark.parametrize("cosines", [(0.9, 0, 0, 0, 1, 0), (1, 0, 0, 0.02, 1, 0)])
def test_directions_that_are_none_are_refused(tmp_path, cosines):
    with pytest.raises(DamagedVolumeError, match="expected two perpendicular directions of length 1"):
        read(save_stack(tmp_path, axial(), orientation=cosines))


def with_length(dataset, path, length):
    """The file with another length in its pixel data's element."""
    save(dataset, path)
    content = path.read_bytes()
    order = "big" if dataset.file_meta.TransferSyntaxUID == ExplicitVRBigEndian else "little"
    tag = b"".join(number.to_bytes(2, order) for number in (0x7FE0, 0x0010))
    place = content.rindex(tag + b"OW\0\0") + 8
    path.write_bytes(content[:place] + length.to_bytes(4, order) + content[place + 4 :] + end(order))


def end(order):
    """What ends pixel data of undefined length."""
    return b"".join(number.to_bytes(2, order) for number in (0xFFFE, 0xE0DD, 0, 0))


@pytest.mark.parametrize(
    ("length", "told", "syntax"),
    [
        (0xFFFFFFFF, "of undefined length", ExplicitVRLittleEndian),
        (0xFFFFFFFF, "of undefined length", ExplicitVRBigEndian),
        (38, "of 38 bytes found, 40 expected", ExplicitVRLittleEndian),
    ],
)
def test_pixels_that_are_not_what_the_syntax_says_are_refused(tmp_path, length, told, syntax):
    for k, position in enumerate(axial()):
        with_length(make_slice(position, k, syntax=syntax), tmp_path / f"{k}", length)
    with pytest.raises(DamagedVolumeError, match=told):
        read(tmp_path)


@pytest.mark.parametrize(
    ("name", "order"),
    [
        ("ct_slicelocation", "location"),
        ("ct_slicelocation", "instance"),
        ("ipp_all_zero", "location"),
        ("sc_instancenumber", "instance"),
        ("imagerpixelspacing", "filename"),
    ],
)
def test_case_of_no_positions(cases, name, order):
    folder = cases / "dicom_no_position" / name
    with pytest.raises(VolumeError, match=r"--s(lice-order|pacing)"):
        read(folder)
    volume = read(folder, slice_order=order, spacing=(0.3, 0.3, 0.3))
    assert (volume.shape, volume.space) == ((48, 40, 20), "none")
    for k in (0, 19):
        values, _ = read_with_itk(folder / f"IM{k + 1:04d}.dcm")
        np.testing.assert_array_equal(physical(volume)[k], values[0])
