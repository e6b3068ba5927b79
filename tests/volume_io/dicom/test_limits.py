"""Each limit of a series' rules holds: one series just on one side of it, one just on the other."""

import math
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from pydicom import dcmread, uid
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, SettingsError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom import pixels as dicom_pixels
from dmc_cli.volume_io.dicom.effort import Effort
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import physical, read


def at(*heights):
    return [(10.0, 20.0, height) for height in heights]


@pytest.mark.parametrize(("apart", "is_one"), [(0.009, True), (0.011, False)])
def test_a_hundredth_of_a_millimetre_is_one_place(tmp_path, apart, is_one):
    for name, position, k in zip("abcd", at(0, 2, 2 + apart, 4), (0, 1, 1, 3), strict=True):
        save(make_slice(position, k), tmp_path / name)
    if is_one:
        with pytest.raises(
            AmbiguousVolumeError, match=r"1 of 4 slices lie where another one lies .*b and c, 0\.009"
        ):
            read(tmp_path)
        volume = read(tmp_path, duplicates="first")
        assert volume.sentences == ("1 slice in the place of another one was left out: c",)
        np.testing.assert_array_equal(volume.values, [plane_values(k) for k in (0, 1, 3)])
    else:
        assert read(tmp_path, slice_gaps="keep").shape[2] == 4


@pytest.mark.parametrize(("off", "is_even"), [(0.009, True), (0.011, False)])
def test_a_hundredth_of_a_millimetre_is_uneven(tmp_path, off, is_even):
    save_stack(tmp_path, at(0, 2 + off, 4, 6), names="abcd")
    volume = read(tmp_path)
    assert (volume.slice_positions is None) == is_even
    if not is_even:
        np.testing.assert_allclose(volume.slice_positions, [0, 2 + off, 4, 6])
        (told,) = volume.sentences
        assert told.startswith(
            "slice distances vary from 1.989 mm between b and c to 2.011 mm between a and b"
        )


@pytest.mark.parametrize(("gap", "is_missing"), [(3.78, False), (3.82, True)])
@pytest.mark.parametrize("place", ["first", "middle", "last"])
def test_a_distance_of_almost_two_is_a_missing_slice(tmp_path, gap, is_missing, place):
    steps = {"first": (gap, 2, 2), "middle": (2, gap, 2), "last": (2, 2, gap)}[place]
    save_stack(tmp_path, at(*np.cumsum([0, *steps])), names="abcd")
    if not is_missing:
        assert read(tmp_path).shape[2] == 4
        return
    pair = {"first": "a and b", "middle": "b and c", "last": "c and d"}[place]
    with pytest.raises(
        AmbiguousVolumeError, match=rf"1 missing slice found: 3\.820 mm between {pair}, 2\.000 mm"
    ):
        read(tmp_path)
    assert any("slices are missing" in warning for warning in read(tmp_path, slice_gaps="keep").sentences)


def test_several_missing_slices_are_counted(tmp_path):
    save_stack(tmp_path, at(0, 2, 6, 8, 12, 14), names="abcdef")
    with pytest.raises(
        AmbiguousVolumeError, match=r"2 missing slices found: 4\.000 mm between b and c, 2\.000 mm elsewhere"
    ):
        read(tmp_path)


@pytest.mark.parametrize(
    ("heights", "count"),
    [((0, 2, 4, 10, 12, 14), 2), ((0, 2, 4, 10, 12, 16, 18), 3), ((0, 2, 4, 6, 15.6), 4)],
)
def test_a_gap_of_several_slices_counts_them_all(tmp_path, heights, count):
    save_stack(tmp_path, at(*heights), names="abcdefgh"[: len(heights)])
    with pytest.raises(AmbiguousVolumeError, match=rf"{count} missing slices found: .* 2\.000 mm elsewhere"):
        read(tmp_path)


@pytest.mark.parametrize("distance", [0.5, 100.0])
def test_two_slices_have_no_gap(tmp_path, distance):
    assert read(save_stack(tmp_path, at(0, distance))).spacing[2] == distance


@pytest.mark.parametrize(("turn", "is_one"), [(0.0009, True), (0.0011, False)])
def test_a_thousandth_is_another_direction(tmp_path, turn, is_one):
    for k, position in enumerate(axial(6)):
        angle = turn if k >= 4 else 0.0
        orientation = (math.cos(angle), math.sin(angle), 0, -math.sin(angle), math.cos(angle), 0)
        save(make_slice(position, k, orientation=orientation), tmp_path / f"{k}")
    entries = list_volumes(str(tmp_path), ReadSettings())
    assert [entry.slices for entry in entries] == ([6] if is_one else [4, 2])


@pytest.mark.parametrize(("factor", "is_one"), [(1.0009, True), (1.0011, False)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_thousandth_is_another_spacing(tmp_path, axis, factor, is_one):
    for k, position in enumerate(axial(6)):
        spacing = [0.5, 0.75]
        spacing[axis] *= factor if k >= 4 else 1.0
        save(make_slice(position, k, PixelSpacing=spacing), tmp_path / f"{k}")
    assert [e.slices for e in list_volumes(str(tmp_path), ReadSettings())] == ([6] if is_one else [4, 2])


@pytest.mark.parametrize(("length", "taken"), [(1.004, True), (1.006, False)])
@pytest.mark.parametrize("which", [0, 4])
def test_directions_are_a_hundredth_long_or_short_at_most(tmp_path, length, which, taken):
    orientation = [1.0, 0, 0, 0, 1.0, 0]
    orientation[which] = length
    save_stack(tmp_path, axial(), orientation=orientation)
    if taken:
        assert read(tmp_path).shape[2] == 4
        return
    with pytest.raises(DamagedVolumeError, match="expected two perpendicular directions"):
        read(tmp_path)


def test_series_are_numbered_as_the_scanner_did(tmp_path):
    for series in ("1.2.10", "1.2.9", "1.2.x"):
        for k, position in enumerate(axial(2)):
            number = None if series.endswith("x") else series[4:]
            dataset = make_slice(
                position, k, series="1.2.777" if number is None else series, SeriesNumber=number
            )
            save(dataset, tmp_path / series / f"{k}")
    entries = list_volumes(str(tmp_path), ReadSettings())
    assert [(e.number, e.uid) for e in entries] == [(1, "1.2.777"), (2, "1.2.9"), (3, "1.2.10")]
    with pytest.raises(
        SettingsError, match=r"(?s)series is '4'; .*--series 3: CT 'series 1\.2\.10', 5 x 4 x 2, UID"
    ):
        read(tmp_path, series="4")
    assert read(tmp_path, series="3").shape == (5, 4, 2)


def test_a_series_number_has_nine_digits_at_most(tmp_path):
    for series, number in (("1.2.1", "123456789"), ("1.2.2", "1234567890"), ("1.2.3", "7"), ("1.2.4", "-3")):
        for k, position in enumerate(axial(2)):
            save(make_slice(position, k, series=series, SeriesNumber=number), tmp_path / series / f"{k}")
    entries = list_volumes(str(tmp_path), ReadSettings())
    assert [e.uid for e in entries] == ["1.2.2", "1.2.4", "1.2.3", "1.2.1"]
    assert [(e.modality, e.size, e.slices) for e in entries] == [("CT", (5, 4, 2), 2)] * 4


def test_several_slices_in_two_places_name_the_first_two(tmp_path):
    save_stack(tmp_path, at(0, 2, 2.004, 2.008, 4, 4), names="abcdef", values=plane_values(0))
    told = (
        r"3 of 6 slices lie where another one lies \(closer than 0\.01 mm\), first b and c, 0\.004 mm apart"
    )
    with pytest.raises(AmbiguousVolumeError, match=told):
        read(tmp_path)
    assert read(tmp_path, duplicates="first").sentences == (
        "3 slices in the place of another one were left out: c, d, f",
    )


@pytest.mark.parametrize(("count", "told"), [(1, "1 DICOM image found"), (2, "2 DICOM images found")])
def test_images_of_no_volume_are_counted(tmp_path, count, told):
    for k in range(count):
        save(make_slice((0, 0, 2 * k), k, series=f"1.2.{k}"), tmp_path / f"{k}")
    with pytest.raises(VolumeError, match=rf"{told}, but no two slices of one volume"):
        read(tmp_path)


def test_three_reasons_of_files_without_images_are_told(tmp_path):
    for k in range(4):
        save(make_slice((0, 0, k), k, SamplesPerPixel=3), tmp_path / f"{k}")
    told = r"no DICOM image found \(0: a colour image; 1: a colour image; 2: a colour image\); expected"
    with pytest.raises(VolumeError, match=told):
        read(tmp_path)


def test_copies_are_told_apart_by_the_first_element_that_does_it_whole(tmp_path):
    """Echo times come before acquisition times, and differ within no copy."""
    for k, position in enumerate(axial(3)):
        for echo in (10, 20):
            time = f"{100000 + 10 * k + echo}"
            dataset = make_slice(position, k, EchoTime=str(echo), AcquisitionTime=time)
            save(dataset, tmp_path / f"{echo}-{k}")
    entries = list_volumes(str(tmp_path), ReadSettings())
    assert [entry.description for entry in entries] == [f"series 1.2.3 (echo time {e} ms)" for e in (10, 20)]


def test_copies_that_nothing_tells_apart_stay_one_stack(tmp_path):
    for k, position in enumerate(axial(3)):
        for copy in "ab":
            save(make_slice(position, k), tmp_path / f"{copy}{k}")
    with pytest.raises(AmbiguousVolumeError, match=r"3 of 6 slices lie where another one lies"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("value", "limit", "expected"),
    [(-2000, None, (-2000, -2000)), (-2000, -1500, (-2000, -1500)), (-1500, -2000, (-2000, -1500))],
)
def test_padding_has_a_lower_and_an_upper_end(tmp_path, value, limit, expected):
    elements = {"PixelPaddingValue": value} | ({} if limit is None else {"PixelPaddingRangeLimit": limit})
    assert read(save_stack(tmp_path, axial(), **elements)).padding == expected


def test_padding_becomes_nan_where_slices_differ(tmp_path):
    for k, position in enumerate(axial(3)):
        slope = "2" if k == 1 else "1"
        save(make_slice(position, k, RescaleSlope=slope, PixelPaddingValue=3), tmp_path / f"{k}")
    volume = read(tmp_path)
    expected = np.array([plane_values(k) * (2.0 if k == 1 else 1.0) - 1024 for k in range(3)])
    expected[0][plane_values(0) == 3] = np.nan
    np.testing.assert_array_equal(physical(volume), expected)
    assert (volume.padding, volume.slope, volume.intercept) == (None, 1, 0)


@pytest.mark.parametrize(("slope", "expected"), [("2", 2), ("0", 1), (None, 1)])
def test_a_slope_of_nothing_is_none(tmp_path, slope, expected):
    volume = read(save_stack(tmp_path, axial(), RescaleSlope=slope, RescaleIntercept="5"))
    assert (volume.slope, volume.intercept) == (expected, 5)
    told = [warning for warning in volume.sentences if "RescaleSlope 0 found in 4 of 4 slices" in warning]
    assert len(told) == len(volume.sentences) == (slope == "0")


@pytest.mark.parametrize(
    "positions",
    [
        [(0, 0, (k * k + 1) * 1e300) for k in range(4)],
        [(1e39, 0, 2.0 * k) for k in range(4)],
        [(0, 0, k * 1e308) for k in (-1, 0, 1)],
    ],
)
def test_slices_farther_than_float32_holds_are_refused(tmp_path, positions):
    with pytest.raises(VolumeError, match=r"a slice at .* mm found; expected coordinates that float32 holds"):
        read(save_stack(tmp_path, positions))


def test_slices_as_far_as_float32_holds_are_read(tmp_path):
    positions = [(0, 0, 1e37 * (k * k + 1)) for k in range(4)]
    volume = read(save_stack(tmp_path, positions), slice_gaps="keep")
    np.testing.assert_allclose(volume.slice_positions, [0, 1e37, 4e37, 9e37])


@pytest.mark.parametrize(("syntax", "ratio"), [(uid.RLELossless, 64), (uid.JPEG2000Lossless, 5000)])
def test_large_frames_need_bytes(tmp_path, monkeypatch, syntax, ratio):
    if syntax != uid.RLELossless:
        pytest.importorskip("openjpeg")
    monkeypatch.setattr(dicom_pixels, "LARGE_FRAME", 1)
    for k, position in enumerate(axial(3)):
        dataset = make_slice(position, k, values=plane_values(k, "<u2", (64, 64)))
        dataset.compress(syntax)
        size = save(dataset, tmp_path / f"{k}").stat().st_size
    assert read(tmp_path).shape == (64, 64, 3)
    name = "LEAST_RLE_RATIO" if ratio == 64 else "LARGEST_RATIO"
    for limit, taken in ((8192 / size + 1, True), (8192 / size - 1, False)):
        monkeypatch.setattr(dicom_pixels, name, limit)
        if taken:
            assert read(tmp_path).shape == (64, 64, 3)
            continue
        with pytest.raises(DamagedVolumeError, match=r"bytes found for 64 x 64 pixels; expected more"):
            read(tmp_path)


@pytest.mark.parametrize("threads", [1, 2, 3, 100])
def test_frames_of_a_file_are_shared_among_threads(tmp_path, threads):
    values = np.array([plane_values(k) for k in range(7)])
    dataset = make_slice((0, 0, 0), 0, values=values[0], NumberOfFrames=7, ImagePositionPatient=None)
    dataset.PixelData = values.tobytes()
    save(dataset, tmp_path / "a.dcm")
    volume = read(tmp_path / "a.dcm", threads=threads)
    np.testing.assert_array_equal(volume.values, values)
    assert volume.space == "none"
    assert any("no positions of its frames" in warning for warning in volume.sentences)


@pytest.mark.parametrize(
    ("elements", "spacing"),
    [
        ({"SpacingBetweenSlices": 3, "SliceThickness": 2}, 3),
        ({"SliceThickness": 2}, 2),
        ({"SpacingBetweenSlices": -3}, 3),
        ({"SpacingBetweenSlices": 0}, 1),
        ({}, 1),
    ],
    ids=str,
)
def test_distances_of_frames_without_a_place(tmp_path, elements, spacing):
    values = np.array([plane_values(k) for k in range(3)])
    dataset = make_slice(
        (0, 0, 0), 0, values=values[0], NumberOfFrames=3, ImagePositionPatient=None, **elements
    )
    dataset.PixelData = values.tobytes()
    save(dataset, tmp_path / "a.dcm")
    volume = read(tmp_path / "a.dcm")
    assert volume.spacing == (0.75, 0.5, spacing)


def enhanced(path, count=3, **groups):
    """Return an image of several frames with its geometry in functional groups."""
    values = np.array([plane_values(k) for k in range(count)])
    plain = {"ImagePositionPatient": None, "ImageOrientationPatient": None, "PixelSpacing": None}
    dataset = make_slice((0, 0, 0), 0, values=values[0], NumberOfFrames=count, **plain)
    dataset.PixelData = values.tobytes()
    shared, orientation, measures = Dataset(), Dataset(), Dataset()
    orientation.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    measures.PixelSpacing = [1, 2]
    shared.PlaneOrientationSequence = Sequence([orientation])
    shared.PixelMeasuresSequence = Sequence([measures])
    dataset.SharedFunctionalGroupsSequence = Sequence([shared])
    frames = []
    for k in range(groups.get("told", count)):
        group, position = Dataset(), Dataset()
        position.ImagePositionPatient = [0, 0, 3 * k]
        # a second item, of which nothing is to be taken
        other = Dataset()
        other.ImagePositionPatient = [9, 9, 9]
        group.PlanePositionSequence = Sequence([position, other])
        frames.append(group)
    dataset.PerFrameFunctionalGroupsSequence = Sequence(frames)
    return save(dataset, path)


@pytest.mark.parametrize("told", [2, 3, 4])
def test_each_frame_has_one_group(tmp_path, told):
    path = enhanced(tmp_path / "a.dcm", told=told)
    if told == 3:
        volume = read(path)
        np.testing.assert_array_equal(volume.affine, np.diag([2, 1, 3, 1]))
        np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(3)])
        return
    with pytest.raises(VolumeError, match=rf"{told} functional groups found for 3 frames"):
        read(path)


def test_long_sequences_are_read_piece_by_piece(tmp_path, monkeypatch):
    from dmc_cli.volume_io.dicom import elements as dicom_elements

    monkeypatch.setattr(dicom_elements, "FEW_BYTES", 0)
    assert read(enhanced(tmp_path / "a.dcm")).shape[2] == 3
    monkeypatch.setattr(dicom_elements, "PIECES_AN_ITEM", -900_000)
    with pytest.raises(VolumeError, match=r"sequence .* cannot be read|no DICOM image"):
        read(tmp_path / "a.dcm")


def test_a_long_header_is_read_once_however_many_threads_decode(tmp_path, monkeypatch):
    dataset = dcmread(enhanced(tmp_path / "a.dcm", count=8))
    dataset[0x52009230].is_undefined_length = True  # pydicom can only parse it to find its end
    dataset.compress(uid.RLELossless)
    dataset.save_as(tmp_path / "a.dcm")
    taken, pieces = Counter(), []
    monkeypatch.setattr(Effort, "take_piece", lambda _: taken.update(["piece"]))
    for threads in (1, 8):
        taken.clear()
        volume = read(tmp_path / "a.dcm", threads=threads)
        np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(8)])
        pieces.append(taken.total())
    assert pieces[0] > 100
    assert pieces[1] < pieces[0] + 7 * 40


def test_another_byte_order_of_the_processor_takes_pydicoms_way(tmp_path, monkeypatch):
    expected = read(save_stack(tmp_path, axial()))
    monkeypatch.setattr(dicom_pixels, "sys", SimpleNamespace(byteorder="big"))
    np.testing.assert_array_equal(read(tmp_path).values, expected.values)


LOCALIZER = ["ORIGINAL", "PRIMARY", "LOCALIZER"]


def test_one_localizer_among_slices_makes_no_stack_of_localizers(tmp_path):
    for k, position in enumerate(axial(3)):
        kind = {"ImageType": LOCALIZER} if k == 1 else {}
        save(make_slice(position, k, **kind), tmp_path / f"a{k}")
        save(make_slice(position, k, series="1.2.4"), tmp_path / f"b{k}")
        save(make_slice(position, k, series="1.2.5", ImageType=LOCALIZER), tmp_path / f"c{k}")
    entries = list_volumes(str(tmp_path), ReadSettings())
    assert [entry.uid for entry in entries] == ["1.2.3", "1.2.4"]


def test_localizers_alone_are_a_volume(tmp_path):
    assert read(save_stack(tmp_path, axial(3), ImageType=LOCALIZER)).shape[2] == 3


@pytest.mark.parametrize("series", [None, "1.2.3", "1"])
def test_of_a_chosen_series_only_its_own_images_are_told(tmp_path, series):
    save_stack(tmp_path, axial(3), names=["a0", "a1", "a2"])
    save(make_slice((0, 0, 0), 0, orientation=(0, 1, 0, 0, 0, 1)), tmp_path / "a3")
    save(make_slice((0, 0, 0), 0, series="1.2.4"), tmp_path / "b0")
    save(make_slice((0, 0, 0), 0, series="1.2.4", ImageType=LOCALIZER), tmp_path / "b1")
    own = "1 image of another orientation, spacing, size or type was left out: a3"
    others = ("1 localizer was left out: b1", own, "1 image of a series without a volume was left out: b0")
    assert read(tmp_path, series=series).sentences == (others if series is None else (own,))
