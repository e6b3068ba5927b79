import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.volume_io.tiff import ome as tiff_ome, reader as tiff, stack
from tests.volume_io.reading import counting, read

tifffile = pytest.importorskip("tifffile")

VALUES = counting((6, 16, 20), "<u2")


@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"bigtiff": True}, {"byteorder": ">"}])
@pytest.mark.parametrize("dtype", ["u1", "u2", "i2", "f4"])
def test_pages_are_slices(tmp_path, options, dtype):
    values = VALUES.astype(dtype)
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="minisblack", **options)
    volume = read(tmp_path / "a.tif", spacing=(1, 2, 3))
    np.testing.assert_array_equal(volume.values, values)
    assert volume.values.dtype == np.dtype(dtype)
    assert volume.spacing == (1, 2, 3)
    assert volume.space == "none"


def test_spacing_of_imagej(tmp_path):
    tifffile.imwrite(
        tmp_path / "a.tif",
        VALUES,
        imagej=True,
        resolution=(1 / 0.25, 1 / 0.5),
        metadata={"spacing": 2.0, "unit": "um", "axes": "ZYX"},
    )
    np.testing.assert_allclose(read(tmp_path / "a.tif").spacing, (0.00025, 0.0005, 0.002))


def test_spacing_of_ome(tmp_path):
    metadata = {"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.25, "PhysicalSizeZ": 3}
    metadata |= {"PhysicalSizeZUnit": "mm", "PhysicalSizeXUnit": "mm"}
    tifffile.imwrite(tmp_path / "a.ome.tif", VALUES, metadata=metadata)
    np.testing.assert_allclose(read(tmp_path / "a.ome.tif").spacing, (0.5, 0.00025, 3))


def test_without_spacing_there_is_a_warning(tmp_path):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack")
    assert "--spacing" in read(tmp_path / "a.tif").sentences[0]


def test_a_folder_of_slices_in_the_order_of_their_numbers(tmp_path):
    for k, plane in enumerate(VALUES):
        tifffile.imwrite(tmp_path / f"s{k + 7}.tif", plane)
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.files[3].name == "s10.tif"


def test_several_volumes_are_chosen_by_index(tmp_path):
    values = counting((2, 6, 16, 20), "<u2")
    tifffile.imwrite(tmp_path / "a.tif", values, imagej=True, metadata={"axes": "TZYX", "spacing": 1})
    with pytest.raises(AmbiguousVolumeError, match="--volume-index"):
        read(tmp_path / "a.tif")
    np.testing.assert_array_equal(read(tmp_path / "a.tif", volume_index=1).values, values[1])


def test_single_and_colour_images_are_refused(tmp_path):
    tifffile.imwrite(tmp_path / "one.tif", VALUES[0])
    tifffile.imwrite(tmp_path / "rgb.tif", np.zeros((16, 20, 3), "u1"), photometric="rgb")
    for name in ("one.tif", "rgb.tif"):
        with pytest.raises(UnsupportedFormatError, match="stack of grey slices"):
            read(tmp_path / name)


@pytest.mark.parametrize("kept", [4, 100, 3000])
def test_truncated_files_are_refused(tmp_path, kept):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack", compression="zlib")
    (tmp_path / "a.tif").write_bytes((tmp_path / "a.tif").read_bytes()[:kept])
    with pytest.raises(VolumeError) as caught:
        read(tmp_path / "a.tif")
    assert caught.value.exit_status == 3


def test_slices_of_different_sizes_are_refused(tmp_path):
    for k in range(3):
        tifffile.imwrite(tmp_path / f"{k}.tif", VALUES[k][: 16 - k])
    with pytest.raises(DamagedVolumeError, match=r"1\.tif: .*as in 0\.tif"):
        read(tmp_path)


def test_what_reads_tiffs_may_be_missing(tmp_path, monkeypatch):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack")
    monkeypatch.setitem(sys.modules, "tifffile", None)
    with pytest.raises(
        UnsupportedFormatError, match=r"a TIFF file found, but tifffile is not installed; pip in"
    ):
        read(tmp_path / "a.tif")


def test_a_folder_without_slices_is_told(tmp_path):
    (tmp_path / "notes.txt").write_text("no slice")
    with pytest.raises(VolumeError, match="no TIFF file found; expected a stack of slices; check the path"):
        read(tmp_path, input_format="tiff")


def test_slices_are_in_the_order_of_all_their_numbers(tmp_path):
    names = ["a.tif", "s2_b10.TIFF", "s2_b9.tif", "s10_b1.tif", "S1.tif"]
    for k, name in enumerate(names):
        tifffile.imwrite(tmp_path / name, VALUES[k])
    files = read(tmp_path).files
    assert [file.name for file in files] == ["S1.tif", "a.tif", "s2_b9.tif", "s2_b10.TIFF", "s10_b1.tif"]


@pytest.mark.parametrize("pages", ["in one file", "a file each"])
def test_what_no_compression_can_hold_is_refused(tmp_path, pages, monkeypatch):
    shape = (3, 64, 64) if pages == "in one file" else (64, 64)
    names = ["a.tif"] if pages == "in one file" else ["a.tif", "b.tif", "c.tif"]
    for name in names:
        tifffile.imwrite(tmp_path / name, np.zeros(shape, "u1"), photometric="minisblack", compression="zlib")
    path = tmp_path / "a.tif" if len(names) == 1 else tmp_path
    size = sum((tmp_path / name).stat().st_size for name in names)
    for ratio, taken in ((3 * 64 * 64 / size + 0.01, True), (3 * 64 * 64 / size - 0.01, False)):
        for module in (tiff, stack):
            monkeypatch.setattr(module, "LARGEST_RATIO", ratio)
        if taken:
            assert read(path).values.sum() == 0
            continue
        with pytest.raises(DamagedVolumeError, match=rf"{size} bytes found for "):
            read(path)


def imagej(path, **metadata):
    told = {"spacing": 2.0, "unit": "mm", "axes": "ZYX", **metadata}
    told = {key: value for key, value in told.items() if value is not None}
    tifffile.imwrite(path, VALUES, imagej=True, resolution=(4, 2), metadata=told)
    return path


@pytest.mark.parametrize(
    ("metadata", "spacing", "told"),
    [
        ({}, (0.25, 0.5, 2), []),
        ({"unit": None}, (0.25, 0.5, 2), ["W-UNIT-MISSING"]),
        ({"unit": "pixel"}, (0.25, 0.5, 2), ["W-UNIT-UNKNOWN"]),
        ({"unit": "inch"}, (6.35, 12.7, 50.8), []),
        ({"unit": "cm"}, (2.5, 5, 20), []),
        ({"unit": "\\u00B5m"}, (0.00025, 0.0005, 0.002), []),
        ({"unit": "micron"}, (0.00025, 0.0005, 0.002), []),
        ({"unit": "\\u00C5"}, (0.25e-7, 0.5e-7, 2e-7), []),
        ({"unit": "nm"}, (0.25e-6, 0.5e-6, 2e-6), []),
        ({"unit": "um", "zunit": "mm"}, (0.00025, 0.0005, 2), []),
        ({"spacing": -2.0}, (0.25, 0.5, 2), []),
    ],
)
def test_units_of_imagej(tmp_path, metadata, spacing, told):
    volume = read(imagej(tmp_path / "a.tif", **metadata))
    np.testing.assert_allclose(volume.spacing, spacing)
    assert [notice.code for notice in volume.warnings] == told


def test_a_unit_of_time_is_no_length(tmp_path):
    with pytest.raises(UnsupportedFormatError, match=r"the axis x of space found in 'sec', a unit of time"):
        read(imagej(tmp_path / "a.tif", unit="sec"))


def test_the_spacing_given_counts_where_the_unit_is_unknown(tmp_path):
    volume = read(imagej(tmp_path / "a.tif", unit="pixel"), spacing=(1, 2, 3))
    assert (volume.spacing, volume.sentences) == ((1, 2, 3), ())


def test_imagej_without_a_spacing_tells_that_along_x_and_y(tmp_path):
    volume = read(imagej(tmp_path / "a.tif", spacing=None))
    assert (volume.spacing, volume.sentences) == (
        (0.25, 0.5, 1),
        ("the TIFF tells no spacing along z; 1 mm is taken; --spacing gives it",),
    )


@pytest.mark.parametrize("unit", [None, "", "pixel"])
def test_imagej_without_a_spacing_and_a_length_tells_none(tmp_path, unit):
    assert read(imagej(tmp_path / "a.tif", spacing=None, unit=unit)).sentences == (
        "the TIFF tells no spacing; 1 mm is taken; --spacing gives it",
    )


@pytest.mark.parametrize(("unit", "length"), [("INCH", 25.4), ("CENTIMETER", 10)])
def test_the_unit_of_the_resolution_is_imagej_s_where_it_names_none(tmp_path, unit, length):
    told = {"imagej": True, "resolution": (4, 2), "metadata": {"axes": "ZYX", "spacing": 2.0}}
    tifffile.imwrite(tmp_path / "a.tif", VALUES, resolutionunit=unit, **told)
    volume = read(tmp_path / "a.tif")
    np.testing.assert_allclose(volume.spacing, np.array((0.25, 0.5, 2)) * length)
    assert volume.sentences == ()


def test_the_origin_of_imagej(tmp_path):
    told = {"xorigin": 10.0, "yorigin": -3.0, "zorigin": 0.5}
    volume = read(imagej(tmp_path / "a.tif", **told))
    np.testing.assert_allclose(volume.affine[:3, 3], (-2.5, 1.5, -1))
    volume = read(imagej(tmp_path / "a.tif", unit="pixel", **told), spacing=(1, 2, 3), origin=(7, 8, 9))
    np.testing.assert_allclose(volume.affine[:3, 3], (-10, 6, -1.5))
    assert [notice.code for notice in volume.warnings] == ["W-OPTION-UNUSED"]


@pytest.mark.parametrize(
    ("calibration", "scale", "told"),
    [
        ({"cf": 0, "c0": -32768.0, "c1": 1.0}, (1, -32768), []),
        ({"cf": 0, "c0": 5.0, "c1": -0.25, "vunit": "HU"}, (-0.25, 5), []),
        ({"cf": 0, "c0": 5.0}, (1, 0), []),
        ({"cf": 20, "c0": 5.0, "c1": 2.0}, (1, 0), []),
        ({"cf": 1, "c0": 5.0, "c1": 2.0, "c2": 3.0}, (1, 0), ["W-VALUES-MAPPED"]),
        ({"cf": 21}, (1, 0), ["W-VALUES-MAPPED"]),
        ({"cf": 0, "c0": 5.0, "c1": 0.0}, (1, 0), ["W-RESCALE-UNKNOWN"]),
    ],
)
def test_the_values_of_imagej_are_calibrated(tmp_path, calibration, scale, told):
    """Calibration.java: 0 is a straight line, 20 none, 21 optical density; one number alone is none."""
    volume = read(imagej(tmp_path / "a.tif", **calibration))
    assert (volume.slope, volume.intercept) == scale
    assert [notice.code for notice in volume.warnings] == told


def test_a_resolution_that_is_not_there_is_one(tmp_path):
    path = imagej(tmp_path / "a.tif")
    with tifffile.TiffFile(path, mode="r+b") as file:
        for tag in ("XResolution", "YResolution"):
            place = file.pages[0].tags[tag].offset
            file.filehandle.seek(place)
            file.filehandle.write((65000 + (tag == "YResolution")).to_bytes(2, "little"))
    np.testing.assert_allclose(read(path).spacing, (1, 1, 2))


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


@pytest.mark.parametrize("stack", [True, False])
def test_pages_to_be_turned_for_display_are_told(tmp_path, stack):
    values = np.arange(3 * 4 * 5, dtype="u1").reshape(3, 4, 5)
    tag = [(274, "H", 1, 5, True)]
    if stack:
        tifffile.imwrite(tmp_path / "a.tif", values, extratags=tag, photometric="minisblack")
    else:
        for k, plane in enumerate(values):
            tifffile.imwrite(tmp_path / f"a{k}.tif", plane, extratags=tag)
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, values)
    assert "W-IMAGE-TURNED" in [notice.code for notice in volume.warnings]


@pytest.mark.parametrize("stack", [True, False])
def test_a_compression_that_needs_another_package_is_told(tmp_path, stack):
    """Not that the file is damaged, as if another copy helped."""
    if find_spec("imagecodecs"):
        pytest.skip("imagecodecs is installed")
    values = np.zeros((3, 40, 50), "u1")
    image = pytest.importorskip("PIL.Image")
    pages = [image.fromarray(plane) for plane in values]
    if stack:
        pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:], compression="tiff_lzw")
    else:
        for k, page in enumerate(pages):
            page.save(tmp_path / f"a{k}.tif", compression="tiff_lzw")
    with pytest.raises(UnsupportedFormatError, match=r"compression LZW.*imagecodecs.*deflate"):
        read(tmp_path)
