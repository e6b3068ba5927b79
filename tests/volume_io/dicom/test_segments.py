"""Segmentation objects: a volume a segment, planes that are left out filled with zeros."""

import numpy as np
import pydicom
import pytest
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import save
from tests.volume_io.dicom.test_frames import enhanced, item, sequence
from tests.volume_io.reading import physical, read

SEGMENTATION = "1.2.840.10008.5.1.4.1.1.66.4"


def segmentation(planes, masks, kind="BINARY", step=2.0, syntax=ExplicitVRLittleEndian):
    """An object with a frame a pair of segment and height, in the order given."""
    dataset, _ = enhanced([height for _, height in planes], syntax=syntax)
    masks = np.asarray(masks, np.uint8)
    bits = 1 if kind == "BINARY" else 8
    dataset.SOPClassUID = SEGMENTATION
    dataset.Modality = "SEG"
    dataset.SegmentationType = kind
    for name in ("RescaleSlope", "RescaleIntercept"):
        delattr(dataset, name)
    dataset.Rows, dataset.Columns = masks.shape[1:]
    dataset.BitsAllocated = dataset.BitsStored = bits
    dataset.HighBit, dataset.PixelRepresentation = bits - 1, 0
    content = np.packbits(masks, bitorder="little").tobytes() if bits == 1 else masks.tobytes()
    dataset.PixelData = content + b"\0" * (len(content) % 2)
    numbers = sorted({segment for segment, _ in planes})
    dataset.SegmentSequence = Sequence(
        item(SegmentNumber=number, SegmentLabel=f"part {number}") for number in numbers
    )
    if step:
        measures = dataset.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0]
        measures.SpacingBetweenSlices = step
    for group, (segment, _) in zip(dataset.PerFrameFunctionalGroupsSequence, planes, strict=True):
        if kind != "LABELMAP":
            group.SegmentIdentificationSequence = sequence(ReferencedSegmentNumber=segment)
    return dataset


def random_masks(count, most=1, shape=(5, 7)):
    """Frames of 35 pixels, so that most do not begin with a byte."""
    return np.random.default_rng(count).integers(0, most + 1, (count, *shape), dtype=np.uint8)


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, ImplicitVRLittleEndian])
def test_segments_are_volumes_and_absent_planes_are_empty(tmp_path, syntax):
    planes = [(1, 0), (2, 4), (1, 4), (10, 10), (10, 8), (2, 2)]
    masks = random_masks(6)
    path = save(segmentation(planes, masks, syntax=syntax), tmp_path / "a")
    np.testing.assert_array_equal(pydicom.dcmread(path).pixel_array, masks)
    entries = list_volumes(str(path), ReadSettings())
    assert [entry.description.split("(")[1] for entry in entries] == [
        "segment 1 part 1)", "segment 2 part 2)", "segment 10 part 10)",
    ]  # fmt: skip
    for number, segment in enumerate((1, 2, 10), 1):
        volume = read(path, series=str(number))
        expected = np.zeros((6, 5, 7))
        for mask, (owner, height) in zip(masks, planes, strict=True):
            if owner == segment:
                expected[int(height / 2)] = mask
        np.testing.assert_array_equal(physical(volume), expected)
        assert volume.spacing == (0.75, 0.5, 2)
        np.testing.assert_array_equal(volume.affine[:3, 3], [1, 2, 0])
        assert volume.slice_positions is None


def test_one_segment_with_planes_left_out(tmp_path):
    masks = random_masks(3)
    volume = read(save(segmentation([(1, 0), (1, 2), (1, 8)], masks), tmp_path / "a"))
    empty = np.zeros_like(masks[0])
    np.testing.assert_array_equal(volume.values, [masks[0], masks[1], empty, empty, masks[2]])


def test_planes_left_out_at_no_stated_distance_are_missing_slices(tmp_path):
    dataset = segmentation([(1, 0), (1, 2), (1, 8)], random_masks(3), step=None)
    with pytest.raises(AmbiguousVolumeError, match="missing slice"):
        read(save(dataset, tmp_path / "a"))


def test_fractions_have_their_highest_value_as_one(tmp_path):
    masks = random_masks(3, 200)
    dataset = segmentation([(1, 0), (1, 2), (1, 4)], masks, "FRACTIONAL")
    dataset.MaximumFractionalValue = 200
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_allclose(physical(volume), masks / 200)


@pytest.mark.parametrize("kind", ["MONOCHROME2", "PALETTE COLOR"])
def test_a_label_map_is_one_volume_of_labels(tmp_path, kind):
    masks = random_masks(3, 5)
    dataset = segmentation([(1, 0), (1, 2), (1, 6)], masks, "LABELMAP")
    dataset.PhotometricInterpretation = kind
    dataset.PixelPaddingValue = 0
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(volume.values, [masks[0], masks[1], np.zeros_like(masks[0]), masks[2]])
    assert volume.padding is None


def test_single_bits_of_another_byte_order_are_refused(tmp_path):
    dataset = segmentation([(1, 0), (1, 2), (1, 4)], random_masks(3), syntax=ExplicitVRBigEndian)
    with pytest.raises(UnsupportedFormatError, match="single bits under the transfer syntax"):
        read(save(dataset, tmp_path / "a"))


def test_bits_that_are_not_there_are_refused(tmp_path):
    dataset = segmentation([(1, 0), (1, 2), (1, 4)], random_masks(3))
    dataset.PixelData = dataset.PixelData[:10]
    with pytest.raises(DamagedVolumeError, match="pixel data of 10 bytes found, 14 expected"):
        read(save(dataset, tmp_path / "a"))
