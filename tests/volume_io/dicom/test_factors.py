"""What differs at one place is a factor; its values are volumes to choose from, never slices."""

import itertools

import numpy as np
import pydicom
import pytest
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, SettingsError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.dicom.test_frames import enhanced, item, many_frames, sequence
from tests.volume_io.reading import physical, read

SYNTAXES = [ExplicitVRLittleEndian, ImplicitVRLittleEndian]


def listed(path):
    return [entry.description for entry in list_volumes(str(path), ReadSettings())]


def save_factors(folder, factors, names=None, places=3, syntax=ExplicitVRLittleEndian):
    """A slice a place and combination of elements, the values telling which; combinations in their order."""
    combinations = list(itertools.product(*factors.values()))
    numbers = np.random.default_rng(0).permutation(len(combinations) * places)
    for place, (n, combination) in itertools.product(range(places), enumerate(combinations)):
        values = plane_values(place) + np.int16(1000 * n)
        elements = dict(zip(factors, combination, strict=True))
        number = int(numbers[place * len(combinations) + n])
        dataset = make_slice((0, 0, 2.0 * place), place, values=values, syntax=syntax, **elements)
        save(dataset, folder / (str(number) if names is None else names.format(number)))
    return [np.array([plane_values(k) + 1000 * n for k in range(places)]) for n in range(len(combinations))]


@pytest.mark.parametrize("syntax", SYNTAXES)
@pytest.mark.parametrize(
    "factors",
    [
        {"EchoTime": ("4.9", "14.7", "104.2"), "ImageType": ("ORIGINAL\\PRIMARY\\M", "ORIGINAL\\PRIMARY\\P")},
        {"InversionTime": ("90", "400", "1200"), "FlipAngle": ("5", "15")},
        {"TemporalPositionIdentifier": (2, 9, 10, 11), "EchoTime": ("8", "12")},
        {
            "DiffusionBValue": (500.0, 1000.0),
            "DiffusionGradientOrientation": ([-1, 0, 0], [0, 1, 0], [0.6, 0, 0.8]),
        },
        {"AcquisitionNumber": (2, 10), "EchoTime": ("2", "10"), "ConvolutionKernel": ("B30", "B70")},
        {"NominalPercentageOfCardiacPhase": (5.0, 40.0, 75.0)},
        {"TriggerTime": ("0", "45", "120"), "ComplexImageComponent": ("MAGNITUDE", "PHASE")},
    ],
)
def test_combinations_of_factors_are_volumes_in_the_order_of_their_numbers(tmp_path, factors, syntax):
    volumes = save_factors(tmp_path, factors, syntax=syntax)
    words = listed(tmp_path)
    assert len(words) == len(set(words)) == len(volumes)
    found = [read(tmp_path, series=str(n + 1)).values for n in range(len(volumes))]
    held = [next(k for k, expected in enumerate(volumes) if np.array_equal(expected, one)) for one in found]
    assert sorted(held) == list(range(len(volumes)))
    for name, values in factors.items():
        if len(factors) == 1:
            assert held == list(range(len(values))), name
    with pytest.raises(AmbiguousVolumeError, match=rf"{len(volumes)} series found.*--series N"):
        read(tmp_path)
    with pytest.raises(AmbiguousVolumeError, match="series found"):
        read(tmp_path, duplicates="first")


def test_a_direction_of_no_numbers_is_none(tmp_path):
    direction = {"DiffusionBValue": 0.0, "DiffusionGradientOrientation": [float("nan")] * 3}
    save_stack(tmp_path, axial(), **direction)
    np.testing.assert_array_equal(read(tmp_path).values, [plane_values(k) for k in range(4)])


def test_a_volume_that_lacks_slices_is_listed_with_those_it_has(tmp_path):
    save_stack(tmp_path / "a", axial(5), EchoTime="5")
    save_stack(tmp_path / "b", axial(3), EchoTime="50")
    assert [entry.slices for entry in list_volumes(str(tmp_path), ReadSettings())] == [5, 3]


def test_repetitions_at_times_of_their_own_are_told_by_their_order(tmp_path):
    volumes = []
    for n in range(3):
        volumes.append([plane_values(k) + np.int16(1000 * n) for k in range(4)])
        for k, position in enumerate(axial()):
            time = f"1012{10 + 4 * k + n}"
            dataset = make_slice(position, k, values=volumes[n][k], AcquisitionTime=time)
            save(dataset, tmp_path / f"{(n * 7 + k * 5) % 23}")
    assert [text.split("(")[1] for text in listed(tmp_path)] == [
        f"acquisition time, {n} of 3 at each place)" for n in (1, 2, 3)
    ]
    for n, expected in enumerate(volumes):
        np.testing.assert_array_equal(read(tmp_path, series=str(n + 1)).values, expected)


def test_a_volume_is_chosen_by_its_index_within_a_series(tmp_path):
    volumes = save_factors(tmp_path / "one", {"EchoTime": ("5", "50")})
    np.testing.assert_array_equal(read(tmp_path, volume_index=1).values, volumes[1])
    np.testing.assert_array_equal(read(tmp_path, series="1.2.3", volume_index=0).values, volumes[0])
    with pytest.raises(SettingsError, match=r"volume_index is 2.*expected 0 to 1"):
        read(tmp_path, volume_index=2)
    save_stack(tmp_path / "other", axial(), series="1.2.9")
    with pytest.raises(AmbiguousVolumeError, match="3 series found"):
        read(tmp_path, volume_index=1)
    assert read(tmp_path, series="1.2.9", volume_index=0).shape == (5, 4, 4)


def test_series_are_sorted_by_their_uid_as_numbers(tmp_path):
    for series in ("1.2.100", "1.2.20", "1.2.3"):
        save_stack(tmp_path / series, axial(), series=series, SeriesNumber="4")
    assert [entry.uid for entry in list_volumes(str(tmp_path), ReadSettings())] == [
        "1.2.3",
        "1.2.20",
        "1.2.100",
    ]


@pytest.mark.parametrize("different", [False, True])
def test_only_true_copies_are_dropped(tmp_path, different):
    save_stack(tmp_path, axial(), names="abcd")
    save(make_slice(axial()[1], 1, values=plane_values(1) + np.int16(different)), tmp_path / "z")
    if different:
        with pytest.raises(AmbiguousVolumeError, match="b and z lie in one place with other values"):
            read(tmp_path, duplicates="first")
    else:
        volume = read(tmp_path, duplicates="first")
        np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(4)])


def test_copies_with_another_rescale_are_no_copies(tmp_path):
    save_stack(tmp_path, axial(), names="abcd")
    save(make_slice(axial()[1], 1, RescaleIntercept="0"), tmp_path / "z")
    with pytest.raises(AmbiguousVolumeError, match="b and z lie in one place with other values"):
        read(tmp_path, duplicates="first")


@pytest.mark.parametrize("syntax", SYNTAXES)
@pytest.mark.parametrize(
    ("label", "name", "element", "values"),
    [
        ("cardiac phase", "CardiacSynchronizationSequence", "NominalPercentageOfCardiacPhase", (5.0, 10.0)),
        ("trigger delay", "CardiacSynchronizationSequence", "NominalCardiacTriggerDelayTime", (90.0, 400.0)),
        (
            "respiratory phase",
            "RespiratorySynchronizationSequence",
            "NominalPercentageOfRespiratoryPhase",
            (5.0, 10.0),
        ),
        ("acquisition", "FrameContentSequence", "FrameAcquisitionNumber", (2, 10)),
        ("inversion time", "MRModifierSequence", "InversionTimes", (90.0, 400.0)),
        ("complex component", "MRImageFrameTypeSequence", "ComplexImageComponent", ("MAGNITUDE", "PHASE")),
        ("metabolite", "MRMetaboliteMapSequence", "MetaboliteMapDescription", ("CHOLINE", "NAA")),
        (
            "magnetization transfer",
            "MRImagingModifierSequence",
            "MagnetizationTransfer",
            ("NONE", "ON_RESONANCE"),
        ),
        ("contrast phase", "ContrastBolusUsageSequence", "ContrastBolusAgentPhase", ("A", "B")),
        ("second tube voltage", "CTAdditionalXRaySourceSequence", "KVP", ("80", "140")),
        (
            "reference date and time",
            "FrameContentSequence",
            "FrameReferenceDateTime",
            ("20200101000000", "20200101000009"),
        ),
        ("dimension 1", "FrameContentSequence", "DimensionIndexValues", ([2, 1], [10, 1])),
    ],
)
def test_groups_of_enhanced_images_are_factors(tmp_path, label, name, element, values, syntax):
    dataset, pixels = enhanced([0, 2, 4, 0, 2, 4], syntax=syntax)
    for number, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        setattr(group, name, sequence(**{element: values[1 - number // 3]}))
    path = save(dataset, tmp_path / "a")
    assert [label in text for text in listed(path)] == [True, True]
    np.testing.assert_array_equal(read(path, series="1").values, pixels[3:])
    np.testing.assert_array_equal(read(path, series="2").values, pixels[:3])


def test_two_factors_of_an_enhanced_image(tmp_path):
    heights = [2.0 * (n % 3) for n in range(18)]
    dataset, pixels = enhanced(heights)
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        diffusion = item(DiffusionBValue=1000.0 if n >= 6 else 0.0)
        if n >= 6:
            direction = ([1, 0, 0], [0, 1, 0])[n // 3 % 2]
            diffusion.DiffusionGradientDirectionSequence = sequence(DiffusionGradientOrientation=direction)
        group.MRDiffusionSequence = Sequence([diffusion])
        group.MREchoSequence = sequence(
            EffectiveEchoTime=(80.0, 20.0)[n // 3 % 2] if n < 6 else (n // 6) * 20.0
        )
    path = save(dataset, tmp_path / "a")
    assert len(listed(path)) == 6
    volumes = [read(path, series=str(n + 1)).values for n in range(6)]
    for n in range(0, 18, 3):
        assert sum(np.array_equal(volume, pixels[n : n + 3]) for volume in volumes) == 1


def test_a_dimension_of_an_organisation_has_its_name(tmp_path):
    dataset, pixels = enhanced([0, 2, 4, 0, 2, 4])
    index = []
    for pointer, label in ((0x00209057, "in-stack"), (0x00189151, "reference time")):
        one = Dataset()
        one.DimensionIndexPointer = pointer
        one.DimensionDescriptionLabel = label
        index.append(one)
    dataset.DimensionIndexSequence = Sequence(index)
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        group.FrameContentSequence = sequence(DimensionIndexValues=[n % 3 + 1, n // 3 + 1])
    path = save(dataset, tmp_path / "a")
    assert ["dimension 2, reference time" in text for text in listed(path)] == [True, True]
    np.testing.assert_array_equal(read(path, series="2").values, pixels[3:])


PLACED = {
    "ImagePositionPatient": [5, 6, 7],
    "ImageOrientationPatient": [1, 0, 0, 0, 1, 0],
    "PixelSpacing": [2, 2],
    "SpacingBetweenSlices": "4",
}


def nuclear(vectors, count):
    """A nuclear medicine file whose vectors are told by FrameIncrementPointer."""
    dataset, values = many_frames([0] * count, Modality="NM", PixelSpacing=[2, 2], SpacingBetweenSlices="4")
    dataset.DetectorInformationSequence = sequence(
        ImagePositionPatient=[5, 6, 7], ImageOrientationPatient=[1, 0, 0, 0, 1, 0]
    )
    dataset.FrameIncrementPointer = [pydicom.datadict.tag_for_keyword(name) for name in vectors]
    for name, numbers in vectors.items():
        setattr(dataset, name, numbers)
    return dataset, values


@pytest.mark.parametrize("syntax", SYNTAXES)
def test_time_slots_of_nuclear_medicine_are_volumes(tmp_path, syntax):
    dataset, values = nuclear({"TimeSlotVector": [1, 1, 1, 2, 2, 2], "SliceVector": [3, 1, 2] * 2}, 6)
    dataset.file_meta.TransferSyntaxUID = syntax
    path = save(dataset, tmp_path / "a")
    assert ["time slot 1" in text for text in listed(path)] == [True, False]
    volume = read(path, series="2")
    np.testing.assert_array_equal(volume.values, values[[4, 5, 3]])
    np.testing.assert_array_equal(volume.affine, [[2, 0, 0, 5], [0, 2, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]])


def test_each_detector_of_nuclear_medicine_has_its_own_place(tmp_path):
    dataset, values = nuclear({"DetectorVector": [1, 1, 1, 2, 2, 2], "SliceVector": [1, 2, 3] * 2}, 6)
    places = [([5, 6, 7], [1, 0, 0, 0, 1, 0]), ([50, 6, 7], [0, 1, 0, 0, 0, -1])]
    dataset.DetectorInformationSequence = Sequence(
        item(ImagePositionPatient=position, ImageOrientationPatient=cosines) for position, cosines in places
    )
    path = save(dataset, tmp_path / "a")
    volume = read(path, series="2")
    np.testing.assert_array_equal(physical(volume), values[3:] - 1024.0)
    np.testing.assert_array_equal(volume.affine[:3], [[0, 0, -4, 50], [2, 0, 0, 6], [0, -2, 0, 7]])


def test_a_vector_has_a_number_a_frame(tmp_path):
    dataset, _ = nuclear({"TimeSlotVector": [1, 1], "SliceVector": [1, 2, 3]}, 3)
    with pytest.raises(DamagedVolumeError, match="2 numbers in element 00540070 found for 3 frames"):
        read(save(dataset, tmp_path / "a"))


@pytest.mark.parametrize(
    ("pointer", "elements", "told"),
    [
        (["FrameTime"], {"FrameTime": "33"}, r"times of one plane \(FrameTime\)"),
        (
            ["FrameTimeVector"],
            {"FrameTimeVector": ["0", "33", "33"]},
            r"times of one plane \(FrameTimeVector\)",
        ),
        (["AngularViewVector"], {"AngularViewVector": [1, 2, 3]}, "views from around"),
        (["RotationVector", "AngularViewVector"], {}, "views from around"),
        (["PageNumberVector"], {"PageNumberVector": [1, 2, 3]}, "pages"),
        (["TimeSliceVector", "PhaseVector"], {}, "differ in phase and time slice"),
        ([], {"SOPClassUID": "1.2.840.10008.5.1.4.1.1.3.1"}, r"times of one plane \(ultrasound\)"),
    ],
)
@pytest.mark.parametrize("place", [{}, PLACED])
def test_frames_that_are_no_slices_are_refused_as_what_they_are(tmp_path, pointer, elements, told, place):
    dataset, _ = many_frames([0, 0, 0], **{**place, **elements})
    if pointer:
        dataset.FrameIncrementPointer = [pydicom.datadict.tag_for_keyword(name) for name in pointer]
    path = save(dataset, tmp_path / "a")
    with pytest.raises(
        VolumeError, match=f"its 3 frames {'' if 'differ' in told else 'are '}{told}"
    ) as error:
        read(path)
    assert error.value.exit_status == 3


def test_frames_with_a_time_and_no_place_are_times(tmp_path):
    dataset, _ = many_frames([0, 0, 0], FrameTime="33")
    with pytest.raises(VolumeError, match=r"its 3 frames are times of one plane \(FrameTime\)"):
        read(save(dataset, tmp_path / "a"))


@pytest.mark.parametrize("kind", ["TILED_FULL", "TILED_SPARSE"])
def test_tiles_are_refused_as_tiles(tmp_path, kind):
    dataset, _ = enhanced([0, 2, 4], DimensionOrganizationType=kind)
    with pytest.raises(VolumeError, match="tiles of a whole-slide image"):
        read(save(dataset, tmp_path / "a"))


def test_a_dose_whose_offsets_are_not_one_a_frame_is_refused(tmp_path):
    dataset, _ = many_frames([0, 0, 0], **PLACED, GridFrameOffsetVector=[0, 2])
    with pytest.raises(DamagedVolumeError, match="2 numbers in element 3004000c"):
        read(save(dataset, tmp_path / "a"))


@pytest.mark.parametrize("name", ["echo_component", "echo_component_unpadded", "dwi_directions"])
def test_case_of_two_factors(cases, name):
    folder = cases / "dicom_two_factors" / name
    expected = 7 if name == "dwi_directions" else 4
    words = listed(folder)
    assert len(words) == expected
    for settings in ({}, {"duplicates": "first"}):
        with pytest.raises(AmbiguousVolumeError, match=f"{expected} series found"):
            read(folder, **settings)
    by_place = {}
    for file in folder.iterdir():
        dataset = pydicom.dcmread(file)
        key = [str(dataset.get(tag)) for tag in ("EchoTime", "ImageType", (0x0018, 0x9087), (0x0018, 0x9089))]
        by_place.setdefault(tuple(key), []).append(dataset)
    for n in range(expected):
        values = read(folder, series=str(n + 1)).values
        assert any(
            np.array_equal(
                values, [d.pixel_array for d in sorted(ds, key=lambda d: d.ImagePositionPatient[2])]
            )
            for ds in by_place.values()
        )


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("acquisition_number", "acquisition"),
        ("cardiac", "cardiac phase"),
        ("cardiac_temporal_index_all_1", "cardiac phase"),
        ("respiratory", "respiratory phase"),
        ("temporal_index", "temporal position"),
    ],
)
def test_case_of_enhanced_phases(cases, name, label):
    path = cases / "enhanced_phases" / f"{name}.dcm"
    dataset = pydicom.dcmread(path)
    indices = np.array(
        [g.FrameContentSequence[0].DimensionIndexValues for g in dataset.PerFrameFunctionalGroupsSequence]
    )
    assert [label in text for text in listed(path)] == [True] * 3
    for phase in (1, 2, 3):
        frames = np.flatnonzero(indices[:, -2] == phase)
        frames = frames[np.argsort(indices[frames, -1])]
        np.testing.assert_array_equal(read(path, series=str(phase)).values, dataset.pixel_array[frames])


@pytest.mark.parametrize("name", ["xa_cine", "us_cine", "us_cine_regions"])
def test_case_of_times(cases, name):
    with pytest.raises(VolumeError, match="its 20 frames are times of one plane"):
        read(cases / "cine_time" / f"{name}.dcm")


def test_case_of_a_stack_without_positions(cases):
    volume = read(cases / "cine_time" / "cbct_multiframe_ct.dcm")
    assert (volume.shape, volume.space) == ((48, 40, 20), "none")
    assert [notice.code for notice in volume.warnings] == ["W-POSITION-MISSING"]


def test_case_of_a_real_order(cases):
    path = cases / "series_order_real" / "3000.dcm"
    words = [text.split("(")[1].split(", ") for text in listed(path)]
    assert [own[0] for own in words] == [f"temporal position {n}" for n in range(1, 14)]
    assert words[0][1:] == ["b-value 0 s/mm2)"]
    assert words[1][1:] == ["b-value 1500 s/mm2", "gradient direction 0 -0.895421 0.44522)"]
    dataset = pydicom.dcmread(path)
    own = [g.FrameContentSequence[0].TemporalPositionIndex for g in dataset.PerFrameFunctionalGroupsSequence]
    pixels = dataset.pixel_array
    volume = read(path, series="10", volume_index=0)
    expected = pixels[np.array(own) == 10]
    for plane in physical(volume)[::13]:
        assert any(np.array_equal(plane, other * 1.0) for other in expected)
