"""Pages that are no slices: previews, masks, colours, and images that lie between the slices."""

from importlib.util import find_spec

import numpy as np
import pytest

from dmc_cli.errors import UnsupportedFormatError
from tests.volume_io.reading import counting, read
from tests.volume_io.tiff import programs

tifffile = pytest.importorskip("tifffile")

VALUES = counting((6, 16, 20), "u1")
PLAIN = {"photometric": "minisblack", "metadata": None}


def told(volume):
    return [(notice.code, notice.sentence) for notice in volume.warnings if "SPACING" not in notice.code]


def write(path, *pages):
    """Write pages, each an array or an array and options."""
    with tifffile.TiffWriter(path) as file:
        for page in pages:
            values, options = page if isinstance(page, tuple) else (page, {})
            file.write(values, **(PLAIN | options))
    return path


@pytest.mark.parametrize(
    ("others", "code"),
    [
        ([(plane[::2, ::2], {"subfiletype": 1}) for plane in VALUES], []),
        ([(plane > 5, {"subfiletype": 4}) for plane in VALUES], []),
        ([(np.zeros((8, 10, 3), "u1"), {"photometric": "rgb"})], []),
        ([np.zeros((8, 10), "u1")], ["W-FILES-LEFT-OUT"]),
    ],
)
def test_previews_and_masks_are_no_volumes(tmp_path, others, code):
    volume = read(write(tmp_path / "a.tif", *VALUES, *others))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert [found for found, _ in told(volume)] == code


def test_a_page_of_another_size_between_the_slices_is_told(tmp_path):
    volume = read(write(tmp_path / "a.tif", *VALUES[:3], VALUES[3, :15], *VALUES[4:]))
    assert volume.shape == (20, 16, 5)
    assert [code for code, _ in told(volume)] == ["W-GEOMETRY-CONTRADICTED", "W-FILES-LEFT-OUT"]
    assert "pages of 20 x 15 pixels lie between the slices" in told(volume)[0][1]


def test_pages_that_ome_does_not_name_are_told(tmp_path):
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, VALUES, metadata={"axes": "ZYX"}, compression="zlib")
    with tifffile.TiffFile(path) as file:
        xml = file.ome_metadata.replace('SizeZ="6"', 'SizeZ="4"')
    tifffile.imwrite(path, VALUES, description=xml.encode(), compression="zlib", **PLAIN)
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES[:4])
    assert told(volume) == [
        ("W-GEOMETRY-CONTRADICTED", "the TIFF's metadata tell of 4 pages, it has 6; the first are taken")
    ]


@pytest.mark.parametrize("planes", ["contig", "separate"])
@pytest.mark.parametrize("compression", [None, "zlib"])
def test_grey_samples_beside_each_other_are_channels(tmp_path, planes, compression):
    channels = np.stack([VALUES, VALUES + 1])
    options = {"planarconfig": planes, "extrasamples": ["unspecified"], "compression": compression}
    stored = np.moveaxis(channels, 0, -1 if planes == "contig" else 1)
    path = write(tmp_path / "a.tif", (stored, options))
    for channel in (0, 1):
        np.testing.assert_array_equal(read(path, channel=str(channel)).values, channels[channel])


def colored(values, *more):
    return np.stack([values, values, values, *more], -1)


@pytest.mark.parametrize("is_folder", [False, True])
def test_grey_written_as_colours_is_grey_and_colours_are_refused(tmp_path, is_folder):
    def stored(pixels):
        options = {"photometric": "rgb"} | ({"extrasamples": ["unassalpha"]} if pixels.shape[-1] == 4 else {})
        if is_folder:
            for k, plane in enumerate(pixels):
                write(tmp_path / f"{k}.tif", (plane, options))
            return tmp_path
        return write(tmp_path / "a.tif", (pixels, options))

    opaque = np.full_like(VALUES, 255)
    for pixels in (colored(VALUES), colored(VALUES.astype("u2")), colored(VALUES, opaque)):
        volume = read(stored(pixels))
        np.testing.assert_array_equal(volume.values, VALUES)
        assert volume.values.dtype == pixels.dtype
    for place in ((2, 3, 4, 1), (2, 3, 4, 3)):
        wrong = colored(VALUES, opaque)
        wrong[place] ^= 1
        with pytest.raises(UnsupportedFormatError, match="colours or transparent pixels"):
            read(stored(wrong))


@pytest.mark.parametrize(("photometric", "parts"), [("separated", 4), ("cielab", 3), ("ycbcr", 3)])
def test_other_colours_are_refused(tmp_path, photometric, parts):
    """Equal parts of them are no grey."""
    pixels = np.stack([VALUES] * parts, -1)
    with pytest.raises(UnsupportedFormatError, match="colours or transparent pixels"):
        read(write(tmp_path / "a.tif", (pixels, {"photometric": photometric})))


def test_bits_that_need_another_package_are_told(tmp_path):
    """Not that the file is damaged, as if another copy helped."""
    if find_spec("imagecodecs"):
        pytest.skip("imagecodecs is installed")
    for k in range(2):
        path = programs.write_stk(tmp_path / f"{k}.tif", VALUES[:1, :, :15], [(0, 1)])
        content = path.read_bytes()
        place = content.index((258).to_bytes(2, "little") + (3).to_bytes(2, "little"))
        path.write_bytes(content[: place + 8] + (12).to_bytes(2, "little") + content[place + 10 :])
    with pytest.raises(UnsupportedFormatError, match=r"12-bit values found, which needs imagecodecs"):
        read(tmp_path)
