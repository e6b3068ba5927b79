"""What OME's metadata tell of a TIFF, and what they may promise."""

from pathlib import Path

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.tiff import ome as tiff_ome
from tests.volume_io.reading import counting, read

tifffile = pytest.importorskip("tifffile")

VALUES = counting((6, 16, 20), "<u2")


def test_spacing_of_ome(tmp_path):
    metadata = {"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.25, "PhysicalSizeZ": 3}
    metadata |= {"PhysicalSizeZUnit": "mm", "PhysicalSizeXUnit": "mm"}
    tifffile.imwrite(tmp_path / "a.ome.tif", VALUES, metadata=metadata)
    np.testing.assert_allclose(read(tmp_path / "a.ome.tif").spacing, (0.5, 0.00025, 3))


def ome(path, **changes):
    metadata = {"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.25, "PhysicalSizeZ": 3, **changes}
    tifffile.imwrite(path, VALUES, metadata={key: v for key, v in metadata.items() if v is not None})
    return path


@pytest.mark.parametrize(
    ("changes", "spacing", "told"),
    [
        ({}, (0.0005, 0.00025, 0.003), []),
        ({"PhysicalSizeZ": None}, (0.0005, 0.00025, 0.001), ["W-SPACING-MISSING"]),
        ({f"PhysicalSize{axis}Unit": "mm" for axis in "XYZ"}, (0.5, 0.25, 3), []),
        ({"PhysicalSizeYUnit": "nm"}, (0.0005, 0.25e-6, 0.003), []),
        ({"PhysicalSizeZUnit": "in"}, (0.0005, 0.00025, 76.2), []),
        ({"PhysicalSizeZUnit": "\u00c5"}, (0.0005, 0.00025, 3e-7), []),
        ({f"PhysicalSize{axis}Unit": "pixel" for axis in "XYZ"}, (0.5, 0.25, 3), ["W-UNIT-UNKNOWN"]),
        ({"PhysicalSizeZUnit": "reference frame"}, (0.0005, 0.00025, 3), ["W-UNIT-UNKNOWN"]),
    ],
)
def test_lengths_of_ome(tmp_path, changes, spacing, told):
    volume = read(ome(tmp_path / "a.ome.tif", **changes))
    np.testing.assert_allclose(volume.spacing, spacing)
    assert [notice.code for notice in volume.warnings] == told


def test_ome_without_lengths_tells_none(tmp_path):
    assert "tells no spacing" in read(ome(tmp_path / "a.ome.tif", PhysicalSizeX=None)).sentences[0]


def changed(path, old, new):
    """Write other XML into an OME-TIFF."""
    with tifffile.TiffFile(path) as file:
        xml = file.ome_metadata
    assert old in xml
    tifffile.tiffcomment(path, xml.replace(old, new).encode())
    return path


def positions(heights, unit="µm"):
    """Elements of OME's XML for the planes of one channel and time."""
    planes = [
        f'<Plane TheC="0" TheT="0" TheZ="{k}" PositionZ="{z}" PositionZUnit="{unit}"/>'
        for k, z in enumerate(heights)
    ]
    return "".join(planes) + "</Pixels>"


@pytest.mark.parametrize(
    ("heights", "unit", "is_told"),
    [
        ((0, 3, 6), "µm", False),
        ((100, 97, 94), "µm", False),
        ((0, 3.005, 5.995), "µm", False),
        ((5, 5, 5), "µm", False),
        ((0, 1, 7), "reference frame", False),
        ((0, 1, 7), "µm", True),
        ((0, 5, 10), "µm", True),
        ((0, 3000, 6000), "nm", False),
        ((0, 3, 6), "nm", True),
        (("nan", 3, 6), "µm", False),
    ],
)
def test_places_of_planes_beside_their_distance_are_told(tmp_path, heights, unit, is_told):
    path = changed(ome(tmp_path / "a.ome.tif"), "</Pixels>", positions(heights, unit))
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, (0.0005, 0.00025, 0.003))
    assert [notice.code for notice in volume.warnings] == ["W-GEOMETRY-CONTRADICTED"] * is_told


def test_slices_that_are_something_else_as_well_are_refused(tmp_path):
    told = '<StructuredAnnotations><XMLAnnotation ID="Annotation:1" Namespace="modulo"><Value><Modulo>'
    told += '<ModuloAlongZ Type="angle" Start="0" End="2"/></Modulo></Value></XMLAnnotation>'
    path = changed(ome(tmp_path / "a.ome.tif"), "</OME>", f"{told}</StructuredAnnotations></OME>")
    with pytest.raises(UnsupportedFormatError, match="slices along z that are angles, too"):
        read(path)


@pytest.mark.parametrize("planes", [6, 1 << 20, (1 << 20) + 1])
def test_the_planes_of_ome_have_an_end(planes):
    xml = f'<OME><Pixels SizeZ="{planes}" SizeC="1"><TiffData IFD="0" PlaneCount="1"/></Pixels></OME>'
    if planes <= 1 << 20:
        tiff_ome.check_ome(xml, 6, Path("a.tif"), "a.tif", False)
        return
    with pytest.raises(
        DamagedVolumeError, match="OME metadata with 1048577 planes, 1 times named, found for 6"
    ):
        tiff_ome.check_ome(xml, 6, Path("a.tif"), "a.tif", False)


@pytest.mark.parametrize(("times", "taken"), [(16, True), (17, False)])
@pytest.mark.parametrize("planes", [6, 9])
def test_planes_are_not_named_again_and_again(times, taken, planes):
    """On the average over as many planes as there are pages, or more."""
    data = f'<TiffData IFD="0" PlaneCount="{max(planes, 7)}"/>' * times
    xml = f'<OME><Pixels SizeZ="{planes}">{data}</Pixels></OME>'
    if taken:
        tiff_ome.check_ome(xml, 7, Path("a.tif"), "a.tif", False)
        return
    with pytest.raises(
        DamagedVolumeError, match=rf"OME metadata with {planes} planes, {max(planes, 7) * 17} times"
    ):
        tiff_ome.check_ome(xml, 7, Path("a.tif"), "a.tif", False)


@pytest.mark.parametrize(
    ("labels", "taken"),
    [
        ('Start="0" End="1048575.9"', True),
        ('Start="0" End="1048576"', False),
        ('Start="1048576" End="0" Step="-1"', False),
        ('Start="5" End="1048580" Step="1"', True),
        ('Start="0" End="2097150" Step="2"', True),
        ('Start="0" End="9" Step="0"', False),
        ('End="1e99"', True),
        ('Start="-1e99"', True),
    ],
)
def test_the_labels_of_an_axis_have_an_end(labels, taken):
    xml = f"<OME><Modulo><ModuloAlongZ {labels}/></Modulo></OME>"
    if taken:
        tiff_ome.check_ome(xml, 6, Path("a.tif"), "a.tif", False)
        return
    with pytest.raises(DamagedVolumeError, match="expected at most 1048576 labels"):
        tiff_ome.check_ome(xml, 6, Path("a.tif"), "a.tif", False)


def test_what_is_no_xml_is_left_to_others(tmp_path):
    tiff_ome.check_ome("<OME", 6, Path("a.tif"), "a.tif", False)


@pytest.mark.parametrize(
    ("named", "taken"), [("b.tif", False), ("A.TIF", True), ("gone.tif", True), ("", True)]
)
def test_the_files_that_ome_names_are_looked_at(tmp_path, named, taken):
    (tmp_path / "b.tif").touch()
    xml = f'<OME><UUID FileName="{named}">urn</UUID><Other FileName="b.tif"/></OME>'
    path = tmp_path / "a.tif"
    if taken:
        tiff_ome.check_ome(xml, 6, path, "a.tif", False)
        return
    with pytest.raises(DamagedVolumeError, match=r"a\.tif \(b\.tif\): the file is empty"):
        tiff_ome.check_ome(xml, 6, path, "a.tif", False)
