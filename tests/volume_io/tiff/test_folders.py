"""Folders of TIFF slices: what their own metadata tell of distances, and of which slice is which."""

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError
from tests.volume_io.reading import counting, read

tifffile = pytest.importorskip("tifffile")

VALUES = counting((4, 6, 7), "u1")
ISOTROPIC_LOG = "Pixel Size (um)={size}\nResult Image Width (pixels)=7\n"


def codes(volume):
    return [notice.code for notice in volume.warnings]


def imagej(folder, unit="um", resolution=(4, 2), **options):
    """Slices as ImageJ saves a sequence: it writes no distance of slices."""
    for k, plane in enumerate(VALUES):
        told = {"unit": unit} if unit else {}
        tifffile.imwrite(
            folder / f"s{k}.tif", plane, imagej=True, resolution=resolution, metadata=told, **options
        )
    return folder


def ome(folder, sizes=(0.5, 0.25, 2), **changes):
    for k, plane in enumerate(VALUES):
        told = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", sizes, strict=True) if size}
        tifffile.imwrite(folder / f"s{k}.ome.tif", plane, metadata={"axes": "YX", **told, **changes})
    return folder


def plain(folder, resolution=None, unit=None):
    for k, plane in enumerate(VALUES):
        tifffile.imwrite(
            folder / f"s{k}.tif", plane, resolution=resolution, resolutionunit=unit, metadata=None
        )
    return folder


def test_lengths_of_imagej_in_each_slice(tmp_path):
    volume = read(imagej(tmp_path))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (0.25e-3, 0.5e-3, 1e-3))
    assert volume.sentences == ("the TIFF tells no spacing along z; 0.001 mm is taken; --spacing gives it",)
    assert read(tmp_path, spacing=(1, 2, 3)).spacing == (1, 2, 3)
    with pytest.raises(AmbiguousVolumeError, match="W-SPACING-MISSING"):
        read(tmp_path, strict=True)


@pytest.mark.parametrize("unit", ["\\u00B5m", "micron", "um", "micrometer"])
def test_spellings_of_imagej_s_unit(tmp_path, unit):
    np.testing.assert_allclose(read(imagej(tmp_path, unit)).spacing, (0.25e-3, 0.5e-3, 1e-3))


def test_a_unit_of_time_is_refused_in_slices_too(tmp_path):
    with pytest.raises(UnsupportedFormatError, match="a unit of time"):
        read(imagej(tmp_path, "sec"))


def test_lengths_of_ome_in_each_slice(tmp_path):
    volume = read(ome(tmp_path))
    np.testing.assert_allclose(volume.spacing, (0.5e-3, 0.25e-3, 2e-3))
    assert codes(volume) == []
    assert codes(read(tmp_path, spacing=(1, 2, 3))) == ["W-OPTION-UNUSED"]


@pytest.mark.parametrize("length", [0.0, -1.0])
def test_lengths_that_are_none_are_refused(tmp_path, length):
    with pytest.raises(DamagedVolumeError, match="expected positive lengths"):
        read(ome(tmp_path, PhysicalSizeX=length))


@pytest.mark.parametrize(
    ("resolution", "unit", "spacing", "told"),
    [
        (
            (571.4, 285.7),
            "CENTIMETER",
            (10 / 571.4, 10 / 285.7, 1),
            "pixels of 0.0175009 x 0.0350018 mm, tells",
        ),
        (
            (1451.43, 1451.43),
            "INCH",
            (25.4 / 1451.43, 25.4 / 1451.43, 1),
            "pixels of 0.0175 x 0.0175 mm, tells",
        ),
        (
            (72, 72),
            "INCH",
            (1, 1, 1),
            "resolution of 72 dpi is that of a screen or printer, tells no spacing; 1",
        ),
        ((300, 300), "INCH", (1, 1, 1), "resolution of 300 dpi is that of a screen or printer, tells"),
        ((37.8, 37.8), "CENTIMETER", (1, 1, 1), "resolution of 96 dpi is that of a screen"),
        ((1, 1), "INCH", (1, 1, 1), "the TIFF tells no spacing; 1 mm"),
        ((57.1, 57.1), "NONE", (1, 1, 1), "the TIFF tells no spacing; 1 mm"),
        (None, None, (1, 1, 1), "the TIFF tells no spacing; 1 mm"),
    ],
)
@pytest.mark.parametrize("is_folder", [True, False])
def test_a_resolution_is_a_distance_where_it_is_none_of_print(
    tmp_path, resolution, unit, spacing, told, is_folder
):
    if is_folder:
        plain(tmp_path, resolution, unit)
    else:
        options = {"metadata": None, "photometric": "minisblack"}
        tifffile.imwrite(tmp_path / "a.tif", VALUES, resolution=resolution, resolutionunit=unit, **options)
    volume = read(tmp_path)
    np.testing.assert_allclose(volume.spacing, spacing, rtol=1e-6)
    assert codes(volume) == ["W-SPACING-MISSING"]
    assert told in volume.sentences[0]
    assert read(tmp_path, spacing=(1, 2, 3)).sentences == ()


def test_imagej_s_inches_of_a_screen_are_none(tmp_path):
    """ImageJ takes 72 dots per inch for no scale, too."""
    volume = read(imagej(tmp_path, None, (72, 72), resolutionunit="INCH"))
    assert volume.spacing == (1, 1, 1)
    assert "72 dpi is that of a screen" in volume.sentences[0]


def test_slices_that_contradict_each_other_are_told(tmp_path):
    imagej(tmp_path)
    told = {"imagej": True, "resolution": (8, 4), "metadata": {"unit": "um"}}
    tifffile.imwrite(tmp_path / "s2.tif", VALUES[2], **told)
    volume = read(tmp_path)
    assert volume.spacing == (1, 1, 1)
    assert codes(volume) == ["W-GEOMETRY-CONTRADICTED", "W-SPACING-MISSING"]
    assert "s0.tif tells distances of 0.00025 x 0.0005 x ? mm, s2.tif of 0.000125 x" in volume.sentences[0]
    assert read(tmp_path, spacing=(1, 2, 3)).sentences == ()
    told |= {"resolution": (4, 2), "metadata": {"unit": "micron"}}  # the same in other words
    tifffile.imwrite(tmp_path / "s2.tif", VALUES[2], **told)
    np.testing.assert_allclose(read(tmp_path).spacing, (0.25e-3, 0.5e-3, 1e-3))


@pytest.mark.parametrize(
    ("write", "size", "spacing", "told"),
    [
        (lambda folder: ome(folder, (0.5, 0.5, 2)), 0.5, (0.5e-3, 0.5e-3, 2e-3), ["W-SPACING-FROM-LOG"]),
        (lambda folder: ome(folder, (0.5, 0.5, None)), 0.5, (0.5e-3,) * 3, ["W-SPACING-FROM-LOG"]),
        (lambda folder: ome(folder, (0.5, 0.5, 2)), 3, (0.5e-3, 0.5e-3, 2e-3), ["W-GEOMETRY-CONTRADICTED"]),
        (
            lambda folder: plain(folder, (20000, 20000), "CENTIMETER"),
            3,
            (3e-3,) * 3,
            ["W-SPACING-FROM-LOG", "W-GEOMETRY-CONTRADICTED"],
        ),
        (lambda folder: plain(folder, (72, 72), "INCH"), 3, (3e-3,) * 3, ["W-SPACING-FROM-LOG"]),
        (lambda folder: imagej(folder, "pixel", (1, 1)), 3, (3e-3,) * 3, ["W-SPACING-FROM-LOG"]),
    ],
)
def test_the_scanner_s_text_beside_slices_that_tell_lengths(tmp_path, write, size, spacing, told):
    write(tmp_path)
    (tmp_path / "s.log").write_text(ISOTROPIC_LOG.format(size=size))
    volume = read(tmp_path)
    np.testing.assert_allclose(volume.spacing, spacing, rtol=1e-9)
    assert [code for code in codes(volume) if code != "W-FILES-LEFT-OUT"] == told


SCHEMA = "http://www.openmicroscopy.org/Schemas/OME/2016-06"
SIZES = {"T": 2, "C": 2, "Z": 4}


def ome_files(folder, axes, named="img_{T}_{C}_{Z}.ome.tif", planes=VALUES):
    """An OME-TIFF of a file a plane, each with the metadata of all."""
    sizes = {axis: SIZES[axis] if axis in axes else 1 for axis in "TCZ"}
    places = [dict(zip("TCZ", place, strict=True)) for place in np.ndindex(*(sizes[axis] for axis in "TCZ"))]
    data = "".join(
        f'<TiffData FirstT="{at["T"]}" FirstC="{at["C"]}" FirstZ="{at["Z"]}" IFD="0" PlaneCount="1">'
        f'<UUID FileName="{named.format(**at)}">urn:{number}</UUID></TiffData>'
        for number, at in enumerate(places)
    )
    channels = "".join(f'<Channel ID="Channel:0:{c}" SamplesPerPixel="1"/>' for c in range(sizes["C"]))
    xml = (
        f'<?xml version="1.0"?><OME xmlns="{SCHEMA}" UUID="urn:@">'
        '<Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint8" SizeX="7" SizeY="6" '
        f'SizeZ="{sizes["Z"]}" SizeC="{sizes["C"]}" SizeT="{sizes["T"]}" '
        f'PhysicalSizeX="0.5" PhysicalSizeY="0.5" PhysicalSizeZ="2">{channels}{data}</Pixels></Image></OME>'
    )
    for number, at in enumerate(places):
        told = {
            "description": xml.replace("@", str(number)),
            "metadata": None,
            "photometric": "minisblack",
        }
        tifffile.imwrite(folder / named.format(**at), planes[number % len(planes)] + number // 4, **told)
    return folder


def test_an_ome_tiff_of_a_file_a_plane_is_what_its_metadata_say(tmp_path):
    volume = read(ome_files(tmp_path, "TCZ"), time="1", channel="0")
    np.testing.assert_array_equal(volume.values, VALUES + 2)
    np.testing.assert_allclose(volume.spacing, (0.5e-3, 0.5e-3, 2e-3))
    assert codes(volume) == []
    assert len(volume.files) == 16
    with pytest.raises(AmbiguousVolumeError, match=r"4 volumes found \(time 0 to 1; channel 0 to 1\)"):
        read(tmp_path)


def test_planes_of_ome_are_in_its_order_not_in_that_of_names(tmp_path):
    values = VALUES[::-1]
    ome_files(tmp_path, "Z", "plane{Z}.ome.tif", values)
    names = [f"plane{z}.ome.tif" for z in range(4)]
    for z in range(4):  # the same planes, under names that run the other way
        path = tmp_path / names[z]
        content = path.read_bytes()
        for n in range(4):
            content = content.replace(names[n].encode(), f"PLANE{3 - n}.ome.tif".encode())
        (tmp_path / f"PLANE{3 - z}.ome.tif").write_bytes(content)
        path.unlink()
    (tmp_path / "notes.txt").write_text("nothing")
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, values)
    assert "notes.txt" in volume.sentences[0]


def test_times_and_channels_of_ome_are_no_slices(tmp_path):
    with pytest.raises(UnsupportedFormatError, match="time 2, y 6, x 7"):
        read(ome_files(tmp_path, "T"))
    for path in sorted(tmp_path.iterdir()):  # renamed, their metadata name no file that is there
        path.rename(tmp_path / f"n{path.name}")
    with pytest.raises(UnsupportedFormatError, match="one of 2 channels or times by its OME metadata"):
        read(tmp_path)


def test_metadata_of_ome_in_another_file_are_told(tmp_path):
    xml = f'<OME xmlns="{SCHEMA}"><BinaryOnly MetadataFile="a.companion.ome" UUID="urn:1"/></OME>'
    for k, plane in enumerate(VALUES):
        tifffile.imwrite(tmp_path / f"{k}.ome.tif", plane, description=xml, metadata=None)
    with pytest.raises(UnsupportedFormatError, match=r"metadata are in a\.companion\.ome, which is not read"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("metadata", "spacing", "told"),
    [
        ({"spacing": 2.0, "unit": "um"}, (0.25e-3, 0.5e-3, 2e-3), []),
        ({"unit": "um"}, (0.25e-3, 0.5e-3, 1e-3), ["W-SPACING-MISSING"]),
        ({"PhysicalSizeX": 3, "PhysicalSizeY": 4.0, "PhysicalSizeZ": 5}, (3e-3, 4e-3, 5e-3), []),
        ({"spacing": [1, 2, 3]}, (6.35, 12.7, 1), ["W-SPACING-MISSING"]),
    ],
)
def test_metadata_that_tifffile_s_users_give_without_imagej(tmp_path, metadata, spacing, told):
    options = {"resolution": (4, 2), "photometric": "minisblack", "resolutionunit": "INCH"}
    tifffile.imwrite(tmp_path / "a.tif", VALUES, metadata={"axes": "ZYX", **metadata}, **options)
    volume = read(tmp_path / "a.tif")
    np.testing.assert_allclose(volume.spacing, spacing)
    assert codes(volume) == told


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_an_image_in_another_file_is_read_from_there(tmp_path, compression):
    """Positions of OME, a file each: the values of the second lie in the second, at the same places."""
    images = ""
    for p in (0, 1):
        uuid = f'<UUID FileName="p{p}.ome.tif">urn:{p}</UUID>'
        planes = "".join(
            f'<TiffData FirstZ="{z}" IFD="{z}" PlaneCount="1">{uuid}</TiffData>' for z in range(4)
        )
        images += (
            f'<Image ID="Image:{p}"><Pixels ID="Pixels:{p}" DimensionOrder="XYZCT" Type="uint8" '
            f'SizeX="7" SizeY="6" SizeZ="4" SizeC="1" SizeT="1">{planes}</Pixels></Image>'
        )
    for p in (0, 1):
        xml = f'<?xml version="1.0"?><OME xmlns="{SCHEMA}" UUID="urn:{p}">{images}</OME>'
        options = {"metadata": None, "photometric": "minisblack", "compression": compression}
        order = "<>"[p]
        values = (VALUES + 50 * p).astype("u1")
        tifffile.imwrite(tmp_path / f"p{p}.ome.tif", values, description=xml, byteorder=order, **options)
    for path in (tmp_path, tmp_path / "p0.ome.tif", tmp_path / "p1.ome.tif"):
        for p in (0, 1):
            np.testing.assert_array_equal(read(path, volume_index=p).values, VALUES + 50 * p)
