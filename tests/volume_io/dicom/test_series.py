"""Images of one series at the same places are told apart by what their headers say."""

import pytest
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.errors import AmbiguousVolumeError
from tests.volume_io.dicom.scanner import axial, save_stack
from tests.volume_io.reading import read


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, ImplicitVRLittleEndian])
@pytest.mark.parametrize(
    ("label", "element", "values"),
    [
        ("echo time", "EchoTime", ("20", "80")),
        ("image type", "ImageType", ("DERIVED", "ORIGINAL")),
        ("acquisition", "AcquisitionNumber", (1, 2)),
        ("temporal position", "TemporalPositionIdentifier", (1, 2)),
        ("trigger time", "TriggerTime", ("0", "40")),
        ("b-value", "DiffusionBValue", (0, 800)),
        ("kernel", "ConvolutionKernel", ("SHARP", "SOFT")),
        ("acquisition time", "AcquisitionTime", ("101112", "101113")),
        ("content time", "ContentTime", ("101112", "101113")),
    ],
)
def test_copies_at_the_same_places_are_stacks_to_choose_from(tmp_path, label, element, values, syntax):
    for name, value in zip("ab", values, strict=True):
        save_stack(tmp_path / name, axial(), syntax=syntax, **{element: value})
    with pytest.raises(AmbiguousVolumeError, match=f"(?s){label} {values[0]}.*{label} {values[1]}"):
        read(tmp_path)
    assert read(tmp_path, series="2").shape == (5, 4, 4)
