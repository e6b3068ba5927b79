"""Series with random geometry, factors, values and gaps are read back as they were written, or refused."""

import itertools
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings, strategies as st
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.errors import AmbiguousVolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import make_slice, save
from tests.volume_io.dicom.test_frames import item, many_frames, sequence
from tests.volume_io.reading import physical, read, world

# shrinking takes minutes; the first failure tells enough
FEW = settings(max_examples=4, phases=[Phase.generate])

DIRECTIONS = [[1.0, 0, 0], [0, 1.0, 0], [0, 0.6, 0.8], [-0.6, 0, 0.8]]

CLASSIC = {
    "EchoTime": ["2.46", "10.5", "104"],
    "DiffusionBValue": [0.0, 50.0, 700.0, 1000.0],
    "DiffusionGradientOrientation": DIRECTIONS,
    "ImageType": [f"ORIGINAL\\PRIMARY\\{part}\\FFE" for part in "MPRI"],
    "TemporalPositionIdentifier": [1, 2, 9, 10],
    "TriggerTime": ["0", "45.5", "91", "1000"],
    "AcquisitionNumber": [1, 2, 10],
    "InversionTime": ["90", "400", "1200"],
    "NominalPercentageOfCardiacPhase": [0.0, 5.0, 75.0],
    "NominalPercentageOfRespiratoryPhase": [0.0, 5.0, 75.0],
    "FlipAngle": ["5", "15", "30"],
    "ComplexImageComponent": ["MAGNITUDE", "PHASE", "REAL"],
    "ConvolutionKernel": ["B30f", "B70f"],
    "KVP": ["80", "140"],
    "FrameReferenceTime": ["4530000.25", "4530000.75", "4531000"],
    "AcquisitionTime": ["101112.125", "101112.25", "101113"],
    "ReceiveCoilName": ["HEA", "HEP"],
    "InPlanePhaseEncodingDirection": ["COL", "ROW"],
    "NominalInterval": ["800", "1100"],
}
"""Elements of single images, with values in the order of their numbers."""

GROUPS = {
    ("MREchoSequence", "EffectiveEchoTime"): [4.5, 20.0, 100.0],
    ("MRDiffusionSequence", "DiffusionBValue"): [0.0, 50.0, 1000.0],
    ("FrameContentSequence", "TemporalPositionIndex"): [1, 2, 10],
    ("FrameContentSequence", "FrameAcquisitionNumber"): [1, 2, 10],
    ("CardiacSynchronizationSequence", "NominalPercentageOfCardiacPhase"): [0.0, 5.0, 75.0],
    ("CardiacSynchronizationSequence", "NominalCardiacTriggerDelayTime"): [0.0, 45.5, 1000.0],
    ("CardiacSynchronizationSequence", "RRIntervalTimeNominal"): [800.0, 1100.0],
    ("RespiratorySynchronizationSequence", "NominalPercentageOfRespiratoryPhase"): [0.0, 5.0, 75.0],
    ("MRModifierSequence", "InversionTimes"): [90.0, 400.0, 1200.0],
    ("MRImageFrameTypeSequence", "ComplexImageComponent"): ["MAGNITUDE", "PHASE"],
    ("MRTimingAndRelatedParametersSequence", "FlipAngle"): [5.0, 15.0],
    ("MRVelocityEncodingSequence", "VelocityEncodingDirection"): DIRECTIONS[:3],
    ("TemporalPositionSequence", "TemporalPositionTimeOffset"): [0.0, 2.5, 10.0],
}
"""Groups of enhanced images and their elements."""


@st.composite
def geometries(draw, least=3, most=5):
    """Affine of a stack, whose axes are perpendicular or tilted like a gantry, and its number of slices."""
    random = np.random.default_rng(draw(st.integers(0, 9999)))
    axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    scale = 10 ** draw(st.floats(-3, 1))
    spacing = scale * random.uniform(0.5, 2, 3)
    if draw(st.booleans()):
        axes[:, 2] += axes[:, 1] * random.uniform(-0.5, 0.5)
    affine = np.eye(4)
    affine[:3, :3] = axes * spacing
    affine[:3, 3] = random.uniform(-200, 200, 3)
    return affine, draw(st.integers(least, most))


def where(affine, k):
    """The elements of slice k, with as many digits as a decimal string holds, and more."""
    x, y = affine[:3, 0], affine[:3, 1]
    lengths = np.linalg.norm(x), np.linalg.norm(y)
    thickness = abs(np.cross(x, y) @ affine[:3, 2]) / (lengths[0] * lengths[1])
    return {
        "SliceThickness": f"{thickness:.8g}",
        "position": decimals(affine[:3, 3] + k * affine[:3, 2]),
        "orientation": decimals([*(x / lengths[0]), *(y / lengths[1])]),
        "PixelSpacing": decimals([lengths[1], lengths[0]]),
    }


def decimals(numbers):
    """Numbers of 16 characters at most, as the standard wants them."""
    return [float(f"{number:.8g}") for number in numbers]


def random_values(random, count, dtype, shape=(3, 4)):
    info = np.iinfo(dtype)
    return random.integers(info.min, info.max, (count, *shape), dtype=dtype, endpoint=True)


def assert_at(volume, affine, heights):
    """The volume's slices lie where the affine has those of the numbers, which begin at either end."""
    scale = np.linalg.norm(affine[:3, :3], axis=0)
    for k, height in enumerate(heights):
        for i, j in ((0, 0), (volume.shape[0] - 1, volume.shape[1] - 1)):
            error = np.abs(world(volume, k, i, j) - (affine @ [i, j, height, 1])[:3]).max()
            assert error <= 1e-6 * 200 + 1e-3 * scale.min()


@st.composite
def factors_of(draw, table, most=3):
    """Some of a table's factors, each with some of its values, which stay in order."""
    names = draw(st.lists(st.sampled_from(sorted(table)), min_size=1, max_size=most, unique=True))
    found = {}
    for name in names:
        few = 3 if len(names) == 1 else 2
        chosen = draw(st.sets(st.integers(0, len(table[name]) - 1), min_size=2, max_size=few))
        found[name] = [table[name][n] for n in sorted(chosen)]
    return found


def write_classic(folder, affine, count, factors, seed, removed=()):
    """A file a slice and combination in random names; values [combination, slice] tell them apart."""
    random = np.random.default_rng(seed)
    combinations = list(itertools.product(*factors.values()))
    values = random_values(random, len(combinations) * count, "<i2").reshape(len(combinations), count, 3, 4)
    names = iter(random.permutation(10000))
    syntax = (ExplicitVRLittleEndian, ImplicitVRLittleEndian)[seed % 2]
    for (n, combination), k in itertools.product(enumerate(combinations), range(count)):
        if (n, k) in removed:
            continue
        elements = dict(zip(factors, combination, strict=True)) | where(affine, k)
        dataset = make_slice(
            elements.pop("position"), 0, values=values[n, k], syntax=syntax, InstanceNumber=None, **elements
        )
        save(dataset, folder / f"{next(names)}.dcm")
    return values


def all_volumes(path):
    entries = list_volumes(str(path), ReadSettings())
    return entries, [read(path, series=str(entry.number)) for entry in entries]


def held(values, volumes):
    """Which combination each volume holds; z may run either way."""
    found = []
    for volume in volumes:
        same = [n for n, one in enumerate(values) if same_planes(physical(volume), one)]
        assert len(same) == 1
        found.append(same[0])
    return found


def same_planes(planes, expected):
    return np.array_equal(planes, expected)


@FEW
@given(geometries(), factors_of(CLASSIC), st.integers(0, 9999))
def test_every_combination_of_classic_images_is_one_volume(geometry, factors, seed):
    affine, count = geometry
    with tempfile.TemporaryDirectory() as folder:
        values = write_classic(Path(folder), affine, count, factors, seed) - 1024.0
        entries, volumes = all_volumes(folder)
        assert len({entry.description for entry in entries}) == len(entries) == len(values)
        order = held(values, volumes)
        assert sorted(order) == list(range(len(values)))
        if len(factors) == 1 and not {"DiffusionGradientOrientation", "ImageType"} & set(factors):
            assert order == sorted(order)
        for volume in volumes:
            assert_at(volume, affine, range(count))
        with pytest.raises(AmbiguousVolumeError, match="series found"):
            read(folder, duplicates="first")


@FEW
@given(geometries(), factors_of(GROUPS), st.integers(0, 9999), st.booleans(), st.booleans())
def test_every_combination_of_an_enhanced_image_is_one_volume(geometry, factors, seed, by_index, by_group):
    affine, count = geometry
    random = np.random.default_rng(seed)
    combinations = list(itertools.product(*factors.values()))
    pairs = list(itertools.product(range(len(combinations)), range(count)))
    frames = [pairs[n] for n in random.permutation(len(pairs))]
    values = random_values(random, len(pairs), "<u2")
    dataset, _ = many_frames(
        [0] * len(pairs), syntax=(ExplicitVRLittleEndian, ImplicitVRLittleEndian)[seed % 2]
    )
    dataset.Rows, dataset.Columns = values.shape[1:]
    dataset.PixelRepresentation, dataset.RescaleIntercept = 0, "0"
    dataset.PixelData = values.tobytes()
    place = where(affine, 0)
    dataset.SharedFunctionalGroupsSequence = Sequence(
        [
            item(
                PlaneOrientationSequence=sequence(ImageOrientationPatient=place["orientation"]),
                PixelMeasuresSequence=sequence(PixelSpacing=place["PixelSpacing"]),
            )
        ]
    )
    groups = []
    for n, k in frames:
        group = item(PlanePositionSequence=sequence(ImagePositionPatient=where(affine, k)["position"]))
        index = [k + 1, *(factors[f].index(v) + 1 for f, v in zip(factors, combinations[n], strict=True))]
        if by_index:
            group.FrameContentSequence = sequence(DimensionIndexValues=index)
        if by_group or not by_index:
            for (name, element), value in zip(factors, combinations[n], strict=True):
                if name not in group:
                    setattr(group, name, sequence())
                setattr(getattr(group, name)[0], element, value)
        groups.append(group)
    dataset.PerFrameFunctionalGroupsSequence = Sequence(groups)
    with tempfile.TemporaryDirectory() as folder:
        path = save(dataset, Path(folder) / "a")
        entries, volumes = all_volumes(path)
        assert len({entry.description for entry in entries}) == len(entries) == len(combinations)
        expected = np.empty((len(combinations), count, *values.shape[1:]))
        for frame, (n, k) in zip(values, frames, strict=True):
            expected[n, k] = frame
        order = held(expected, volumes)
        assert sorted(order) == list(range(len(combinations)))
        if len(factors) == 1:
            assert order == sorted(order)
        for volume in volumes:
            assert_at(volume, affine, range(count))


@st.composite
def storages(draw):
    """Bits of a value: type, BitsStored, HighBit."""
    dtype = np.dtype(draw(st.sampled_from(["u1", "i1", "<u2", "<i2", "<u4", "<i4"])))
    stored = draw(st.integers(2, 8 * dtype.itemsize if dtype.itemsize < 4 else 24))
    return dtype, stored, draw(st.integers(stored, 8 * dtype.itemsize)) - 1


@FEW
@given(geometries(), storages(), st.booleans(), st.booleans(), st.integers(0, 9999))
def test_values_of_any_storage_and_rescale_are_exact(geometry, storage, per_slice, padded, seed):
    affine, count = geometry
    dtype, stored, high = storage
    random = np.random.default_rng(seed)
    least = -(1 << stored - 1) if dtype.kind == "i" else 0
    values = random.integers(least, least + (1 << stored), (count, 3, 5))
    slopes = random.choice([0.5, 1.0, 3.0, -2.25], count if per_slice else 1)
    intercepts = random.choice([0.0, -1024.0, 12.5], count if per_slice else 1)
    padded &= stored <= 16
    padding = int(values[0, 0, 0]) if padded else None
    expected = values * np.resize(slopes, (count, 1, 1)) + np.resize(intercepts, (count, 1, 1))
    if padded:
        expected[values == padding] = np.nan
    with tempfile.TemporaryDirectory() as folder:
        for k in random.permutation(count):
            bits = (values[k] & ((1 << stored) - 1)) << (high + 1 - stored)
            if high == stored - 1 and random.integers(2):
                bits = values[k]
            plane = bits.astype(np.int64).astype(dtype)
            elements = where(affine, k) | {"BitsStored": stored, "HighBit": high}
            elements |= {
                "RescaleSlope": slopes[k % len(slopes)],
                "RescaleIntercept": intercepts[k % len(slopes)],
            }
            dataset = make_slice(elements.pop("position"), 0, values=plane, **elements)
            if padded:
                dataset.add_new(
                    0x00280120,
                    "SS" if dtype.kind == "i" else "US",
                    padding & 0xFFFF if dtype.kind == "u" else padding,
                )
            save(dataset, Path(folder) / f"{random.integers(1 << 40)}")
        volume = read(folder)
        found = physical(volume)
        if volume.padding is not None:
            found[(volume.values >= volume.padding[0]) & (volume.values <= volume.padding[1])] = np.nan
        np.testing.assert_array_equal(found, expected.astype(found.dtype))
        assert_at(volume, affine, range(count))


@st.composite
def removals(draw, volumes, count):
    """Pairs of volume and slice that are not there: two slices of each volume are."""
    pairs = list(itertools.product(range(volumes), range(count)))
    removed = draw(st.sets(st.sampled_from(pairs), min_size=1, max_size=len(pairs) // 2))
    return {(n, k) for n, k in removed if sum((n, other) not in removed for other in range(count)) >= 2}


@FEW
@given(geometries(5, 7), st.data())
def test_a_volume_that_lacks_slices_of_its_series_is_refused_or_told(geometry, data):
    affine, count = geometry
    factors = {"EchoTime": ["5", "50"], **data.draw(st.sampled_from([{}, {"FlipAngle": ["5", "15"]}]))}
    volumes = 2 ** len(factors)
    removed = data.draw(removals(volumes, count))
    with tempfile.TemporaryDirectory() as folder:
        values = write_classic(Path(folder), affine, count, factors, 1, removed) - 1024.0
        try:
            entries = list_volumes(folder, ReadSettings())
        except AmbiguousVolumeError:
            return
        for entry in entries:
            assert_whole_or_told(folder, entry, values, affine, count)


def assert_whole_or_told(folder, entry, values, affine, count):
    """A volume has all its slices where they are, or is refused, or its warnings tell."""
    try:
        volume = read(folder, series=str(entry.number))
    except AmbiguousVolumeError as error:
        assert error.exit_status == 4
        return
    is_told = bool({"W-SLICES-MISSING", "W-SLICES-DOUBTFUL"} & {notice.code for notice in volume.warnings})
    planes = physical(volume)
    places = [
        place
        for place in itertools.product(range(len(values)), range(count))
        if any(np.array_equal(values[place], plane) for plane in planes)
    ]
    assert len({n for n, _ in places}) == 1
    heights = [k for _, k in places]
    assert is_told == (len(heights) < count)
    # slices that all volumes lack show by their thickness alone
    assert len(set(np.diff(heights))) == 1
    assert_at(volume, affine, heights)


@FEW
@given(geometries(6, 9), st.data())
def test_any_slices_of_one_volume_that_are_missing_are_refused_or_told(geometry, data):
    affine, count = geometry
    inner = data.draw(st.sets(st.integers(1, count - 2), min_size=1))
    with tempfile.TemporaryDirectory() as folder:
        for k in set(range(count)) - inner:
            elements = where(affine, k)
            save(make_slice(elements.pop("position"), k, **elements), Path(folder) / f"{97 * k % 101}")
        try:
            volume = read(folder)
        except AmbiguousVolumeError as error:
            assert error.exit_status == 4
        else:
            assert "W-SLICES-DOUBTFUL" in {notice.code for notice in volume.warnings}
