"""Small facts that many readers rely on, each where it is made."""

import bz2
import gzip
import io
import lzma
import struct
import zipfile
import zlib

import numpy as np
import pytest
from pydicom.dataelem import RawDataElement
from pydicom.dataset import Dataset
from pydicom.tag import Tag

from dmc_cli.errors import VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume.volume import Volume
from dmc_cli.volume_formats import format_of_start
from dmc_cli.volume_io.dicom import reader as dicom
from dmc_cli.volume_io.dicom.codestream import image_size, lacks_end
from dmc_cli.volume_io.dicom.elements import integer, items, numbers, text
from dmc_cli.volume_io.dicom.header import _is_plausible
from dmc_cli.volume_io.read import check_input, list_volumes
from dmc_cli.volume_io.unpacked_size import passes, unpacked
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import counting, read

VALUES = counting((3, 4, 5), "<i2")


@pytest.mark.parametrize(("length", "taken"), [(64, True), (65, False)])
def test_the_last_number_of_a_text_is_no_endless_one(tmp_path, length, taken):
    header = b"NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nencoding: ascii\n\n"
    (tmp_path / "a.nrrd").write_bytes(header + b"7 " * 59 + b"0" * length)
    if taken:
        assert read(tmp_path / "a.nrrd").values.sum() == 7 * 59
        return
    with pytest.raises(VolumeError, match="more than 64 characters"):
        read(tmp_path / "a.nrrd")


def test_values_without_a_scale_are_physical(tmp_path):
    (tmp_path / "a.nrrd").write_bytes(
        b"NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nencoding: raw\nendian: little\n\n"
        + VALUES.tobytes()
    )
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    np.save(tmp_path / "a.npy", VALUES)
    told = {"shape": (5, 4, 3), "dtype": "int16"}
    for name, settings in (("a.nrrd", {}), ("a.raw", told), ("a.npy", {})):
        volume = read(tmp_path / name, **settings)
        assert (volume.slope, volume.intercept, volume.padding) == (1, 0, None)
        np.testing.assert_array_equal(volume.affine, np.eye(4))
        assert volume.files == (tmp_path / name,)
        assert volume.path == str(tmp_path / name)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, (0, 59)),
        ({"slope": 2.0, "intercept": 3.0}, (3, 121)),
        ({"slope": -2.0, "intercept": 3.0}, (-115, 3)),
        ({"padding": (0, 1)}, (2, 59)),
        ({"padding": (59, 59)}, (0, 58)),
        ({"padding": (0, 59)}, None),
    ],
)
def test_the_range_of_the_values_that_are_data(changes, expected):
    volume = Volume(values=VALUES, affine=np.eye(4), space="none", **changes)
    assert volume.value_range() == expected


def test_the_range_without_what_is_no_number():
    values = VALUES.astype("f4")
    values[0] = np.nan
    values[1, 0, 0], values[2, 3, 4] = np.inf, -np.inf
    assert Volume(values=values, affine=np.eye(4), space="none").value_range() == (21, 58)
    values[:] = np.nan
    assert Volume(values=values, affine=np.eye(4), space="none").value_range() is None


def test_thin_slices_are_refused_before_they_are_read(tmp_path, monkeypatch):
    save_stack(tmp_path, axial(), values=plane_values(0, shape=(1, 5)))
    monkeypatch.setattr(dicom, "read_slices", None)
    with pytest.raises(VolumeError, match="5 x 1 x 4 nodes found; a surface needs at least two"):
        read(tmp_path)


PACKED = {"zlib": zlib.compress, "gzip": gzip.compress, "bz2": bz2.compress, "lzma": lzma.compress}


@pytest.mark.parametrize("codec", PACKED)
def test_pieces_are_unpacked_to_their_limit_and_their_end(codec):
    packed = PACKED[codec](b"abc" * 100)
    assert unpacked(codec, packed, 300) == b"abc" * 100
    with pytest.raises(ValueError, match="more bytes than expected"):
        unpacked(codec, packed, 299)
    with pytest.raises(ValueError, match="the end is missing"):
        unpacked(codec, packed[:-12], 300)
    assert unpacked(codec, PACKED[codec](b""), 0) == b""


@pytest.mark.parametrize("codec", ["gzip", "bz2", "lzma"])
def test_streams_that_follow_one_another(codec):
    packed = PACKED[codec](b"abc") + PACKED[codec](b"de")
    assert unpacked(codec, packed, 5) == b"abcde"
    with pytest.raises(ValueError, match="more bytes than expected"):
        unpacked(codec, packed, 4)
    assert unpacked(codec, PACKED[codec](b"abc") + b"\0\0\0\0\0\0", 5) == b"abc"


def test_one_zlib_stream_is_all():
    assert unpacked("zlib", zlib.compress(b"abc") + zlib.compress(b"de"), 5) == b"abc"


@pytest.mark.parametrize("codec", ["zlib", "gzip", "bz2", "lzma"])
def test_what_passes_its_place_by_far(codec, monkeypatch):
    monkeypatch.setattr("dmc_cli.volume_io.unpacked_size.SLACK", 1000)
    packed = PACKED[codec](bytes(5000))
    assert passes(codec, packed, 3999)
    assert not passes(codec, packed, 4000)
    assert not passes(codec, packed[: len(packed) // 2] + b"damage", 4000)
    assert passes("lz4", (5001).to_bytes(4, "little"), 4000)
    assert not passes("lz4", (5000).to_bytes(4, "little"), 4000)
    assert not passes("other", packed, 0)


@pytest.mark.parametrize(
    ("start", "plausible"),
    [
        (b"\x08\0\x05\0CS\x0a\0ISO_IR 100", True),
        (b"\x02\0\0\0UL\x04\0\0\0\0\0\0\0", True),
        (b"\0\x08\0\x05CS\0\x0aISO_IR 100", True),
        (b"\x08\0\x05\0\x0a\0\0\0ISO_IR 100", True),
        (b"\x08\0\x05\0\x7f\0\0\0ISO_IR 100", True),
        (b"\x08\0\x05\0\x80\0\0\0ISO_IR 100", False),
        (b"\x08\0\x05\0cs\x0a\0ISO_IR 100", False),
        (b"\x08\0\x05\0C1\x0a\0ISO_IR 100", False),
        (b"\x10\0\x05\0CS\x0a\0ISO_IR 100", False),
        (b"\x08\0\x05\0CS\x0a\0ISO", False),
    ],
)
def test_files_without_a_preamble_begin_with_an_element(start, plausible):
    assert _is_plausible(start) == plausible


ITEM = struct.pack("<HHI", 0xFFFE, 0xE000, 0)
DELIMITER = struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)
TAG = Tag(0x00081140)


def sequence(value, implicit=True):
    dataset = Dataset()
    dataset[TAG] = RawDataElement(TAG, None if implicit else "SQ", len(value), value, 0, implicit, True)
    return dataset


@pytest.mark.parametrize(
    ("value", "most", "count"),
    [(ITEM * 3, 1, 1), (ITEM * 3, 2, 2), (ITEM * 3, 9, 3), (ITEM + DELIMITER + ITEM, 9, 1), (b"", 9, 0)],
)
@pytest.mark.parametrize("implicit", [True, False])
def test_the_first_items_of_a_sequence(value, most, count, implicit):
    dataset = sequence(value, implicit)
    assert len(items(dataset, TAG, most)) == count
    assert len(items(dataset, TAG, most)) == count
    assert items(dataset, Tag(0x00081141)) == items(None, TAG) == []


def test_only_the_first_item_tells_where_a_frame_lies(tmp_path):
    from tests.volume_io.dicom.test_limits import enhanced

    path = enhanced(tmp_path / "a.dcm")
    content = path.read_bytes()
    place = struct.pack("<HH2s", 0x20, 0x32, b"DS")
    assert content.count(place) == 6
    first = content.index(place)
    path.write_bytes(content[:first] + struct.pack("<HH", 0x20, 0x33) + content[first + 4 :])
    with pytest.raises(VolumeError, match="no position or orientation"):
        read(path)


class Element:
    """An element as `dicom_elements` looks at it."""

    def __init__(self, value, kind=None, little=True):
        self.value, self.VR, self.is_little_endian = value, kind, little


class Elements(dict):
    get_item = dict.get


@pytest.mark.parametrize(
    ("element", "count", "expected"),
    [
        (Element(b"1.5\\-2 "), None, [1.5, -2]),
        (Element(b"1\\2"), 2, [1, 2]),
        (Element(b"1\\2"), 3, None),
        (Element(b"1\\x"), None, None),
        (Element(b"nan"), None, None),
        (Element(struct.pack("<2H", 3, 4), "US"), 2, [3, 4]),
        (Element(struct.pack(">2H", 3, 4), "US", little=False), 2, [3, 4]),
        (Element(struct.pack("<d", 0.5), "FD"), 1, [0.5]),
        (Element(struct.pack("<h", -5), "SS"), 1, [-5]),
        (Element(struct.pack("<d", np.inf), "FD"), 1, None),
        (Element(b"abc", "US"), None, None),
        (Element([1.0, 2.0]), 2, [1, 2]),
        (Element(7), 1, [7]),
    ],
)
def test_numbers_of_an_element(element, count, expected):
    dataset = Elements({1: element})
    if expected is None:
        with pytest.raises(VolumeError, match=r"element 00000001 holds .*expected"):
            numbers(dataset, 1, count)
        return
    assert numbers(dataset, 1, count) == expected
    assert numbers(dataset, 2, count) is None
    assert numbers(Elements({1: Element(b"")}), 1, count) is None


@pytest.mark.parametrize(
    ("element", "signed", "expected"),
    [
        (Element(b"\x01\x02"), False, 0x201),
        (Element(b"\x01\x02", little=False), False, 0x102),
        (Element(b"\xff\xff"), True, -1),
        (Element(b"\xff\xff"), False, 65535),
        (Element(b"\1\0\0\0"), False, 1),
        (Element(b"\1\0\0"), False, 9),
        (Element(0x8000, "US"), True, -0x8000),
        (Element(0x7FFF, "US"), True, 0x7FFF),
        (Element(0x8000, "US"), False, 0x8000),
        (Element(0x8000, "SS"), True, 0x8000),
        (Element(None), False, 9),
    ],
)
def test_integers_of_an_element(element, signed, expected):
    assert integer(Elements({1: element}), 1, 9, signed=signed) == expected
    assert integer(Elements({}), 1, 9, signed=signed) == 9


def test_an_element_that_cannot_be_looked_at_is_told():
    class Strange(dict):
        def get_item(self, tag):
            raise ValueError("nothing of a kind")

    with pytest.raises(
        VolumeError, match=r"element 00000001 cannot be read \(nothing of a kind\); get the file"
    ):
        text(Strange({1: None}), 1)
    assert text(Strange(), 1) == text(None, 1) == ""


def test_texts_of_an_element():
    assert text(Elements({1: Element(b" CT \0")}), 1) == "CT"
    assert text(Elements({1: Element("größe".encode("latin-1"))}), 1) == "größe"
    assert text(Elements({1: Element("größe".encode())}), 1) == "größe"
    assert text(Elements({1: Element(b"a\\b")}), 1) == "a"
    assert text(Elements({1: Element(b"")}), 1) == text(Elements({}), 1) == ""


def jpeg(code, rows, columns, components, before=b""):
    return b"\xff\xd8" + before + struct.pack(">BBHBHHB", 0xFF, code, 11, 8, rows, columns, components)


@pytest.mark.parametrize(
    ("stream", "size"),
    [
        (jpeg(0xC0, 3, 4, 1), (4, 3, 1)),
        (jpeg(0xC3, 3, 4, 3), (4, 3, 3)),
        (jpeg(0xF7, 3, 4, 1), (4, 3, 1)),
        (jpeg(0xC0, 3, 4, 1, b"\xff\xc4\0\4ab"), (4, 3, 1)),
        (jpeg(0xC0, 3, 4, 1, b"\xff\xff\xff\xe0\0\2"), (4, 3, 1)),
        (jpeg(0xC0, 3, 4, 1, b"ab"), None),
        (jpeg(0xC0, 3, 4, 1)[:8], None),
        (b"\xff\x4f\xff\x51" + struct.pack(">HH8IH", 41, 0, 9, 8, 2, 1, 9, 8, 2, 1, 1), (7, 7, 1)),
        (b"box" + b"\xff\x4f\xff\x51" + struct.pack(">HH8IH", 41, 0, 9, 8, 0, 0, 9, 8, 0, 0, 3), (9, 8, 3)),
        (b"nothing", None),
        (b"", None),
    ],
)
def test_the_size_that_a_codestream_tells(stream, size):
    assert image_size(stream) == size


def test_a_jpeg_ls_stream_has_an_end():
    start = b"\xff\xd8\xff\xf7"
    assert lacks_end(start)
    assert not lacks_end(start + b"ab\xff\xd9")
    assert not lacks_end(b"\xff\xd8\xff\xc0")
    assert not lacks_end(b"\xff\xf7")


@pytest.mark.parametrize(
    ("start", "found"),
    [
        (bytes(128) + b"DICM", "dicom"),
        (b"PK\x03\x04", "dicom"),
        (b"\x08\0", "dicom"),
        (b"NRRD0005", "nrrd"),
        (bytes(344) + b"n+1\0", "nifti"),
        (bytes(344) + b"ni1\0", "nifti"),
        (bytes(4) + b"n+2\0", "nifti"),
        (b"\x5c\x01\0\0", "analyze"),
        (b"\0\0\x01\x5c", "analyze"),
        (b"\x93NUMPY", "numpy"),
        (b"II*\0", "tiff"),
        (b"MM\0*", "tiff"),
        (b"II+\0", "tiff"),
        (b"MM\0+", "tiff"),
        (b"NDims = 3\nDimSize = 1 2 3\n", "meta"),
        (b"NDims = 3\n", None),
        (b"\x08\0NDims DimSize", "dicom"),
        (b"\x02\0", "dicom"),
        (b"\0\0\0\1" + bytes(16) + b"\0\0\0\3" + bytes(5), "mgh"),
        (b"\0\0\0\1" + bytes(16) + b"\0\0\0\3", None),  # cut off before the flag that tells
        (bytes(500), None),
    ],
)
def test_what_files_begin_with(start, found):
    assert format_of_start(start) == found


def test_inputs_that_are_fields():
    check_input("synth:sphere:5", ReadSettings())
    check_input("-", ReadSettings())
    (entry,) = list_volumes("synth:sphere:5", ReadSettings())
    assert (entry.size, entry.number, entry.slices) == ((5, 5, 5), 1, 5)
    with pytest.raises(ValueError, match="synth"):
        check_input("synth:nothing:5", ReadSettings())


@pytest.mark.parametrize(
    "options", [{"bigtiff": True, "byteorder": ">"}, {"bigtiff": True, "byteorder": "<"}]
)
def test_chains_of_pages_in_both_byte_orders(tmp_path, options):
    tifffile = pytest.importorskip("tifffile")
    with tifffile.TiffWriter(tmp_path / "a.tif", **options) as writer:
        for plane in VALUES:
            writer.write(plane, contiguous=False, metadata=None)
    np.testing.assert_array_equal(read(tmp_path / "a.tif").values, VALUES)


@pytest.mark.parametrize("damage", ["loop", "beyond", "short"])
def test_chains_of_pages_that_end_nowhere(tmp_path, damage):
    tifffile = pytest.importorskip("tifffile")
    path = tmp_path / "a.tif"
    with tifffile.TiffWriter(path) as writer:
        for plane in VALUES:
            writer.write(plane, contiguous=False, metadata=None)
    with tifffile.TiffFile(path) as tiff:
        first, last = tiff.pages[0].offset, tiff.pages[2].offset
    content = bytearray(path.read_bytes())
    count = int.from_bytes(content[last : last + 2], "little")
    target = {"loop": first, "beyond": len(content), "short": len(content) - 3}[damage]
    struct.pack_into("<I", content, last + 2 + 12 * count, target)
    path.write_bytes(content)
    with pytest.raises(VolumeError, match=r"page \d of a\.tif (points astray|is cut short)"):
        read(path)


def test_a_series_in_a_folder_below(tmp_path):
    for k, position in enumerate(axial(3)):
        save(make_slice(position, k), tmp_path / "deep" / "er" / f"{k}")
    volume = read(tmp_path)
    assert [path.name for path in volume.files] == ["0", "1", "2"]
    assert io.BytesIO(volume.files[0].read_bytes()).read(132)[128:] == b"DICM"


def test_a_geometry_that_spans_nothing_is_refused_before_slices_are_read(tmp_path, monkeypatch):
    save_stack(tmp_path, axial(), PixelSpacing=["1e-200", "1e-200"])
    monkeypatch.setattr(dicom, "read_slices", None)
    with pytest.raises(VolumeError, match="do not span the space"):
        read(tmp_path)


def test_a_zip_without_images_is_no_zarr_store(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("notes.txt", "no image")
    with pytest.raises(VolumeError, match="no DICOM image found"):
        read(tmp_path / "a.zip")
