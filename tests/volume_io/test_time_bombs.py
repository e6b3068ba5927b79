"""Small files that would keep a reader busy for minutes: refused, or passed over, within 2 s and 512 MiB."""

import bz2
import gzip
import io
import os
import struct
import zipfile

import numpy as np
import pytest
from pydicom import uid
from pydicom.encaps import encapsulate, generate_frames

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.volume_io.dicom import effort as dicom_effort, reader as dicom, storage as dicom_storage
from dmc_cli.volume_io.dicom.effort import Effort, PiecewiseStream, TooMuchError
from dmc_cli.volume_io.unpacked_size import told_size
from dmc_cli.volume_io.zip_archive import unpacked_start
from tests.fuzz.trial import try_file
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import counting, read

MARK = bytes(128) + b"DICM"
ELEMENT = struct.pack("<HH2sHI", 2, 0, b"UL", 4, 0)
SEQUENCE = struct.pack("<HH2sHI", 8, 0x1140, b"SQ", 0, 0xFFFFFFFF)
ITEM = struct.pack("<HHI", 0xFFFE, 0xE000, 0)
BEGINNINGS = {
    "commands": MARK + bytes(4 << 20),
    "meta elements": MARK + ELEMENT * (1 << 19),
    "zeros behind meta elements": MARK + ELEMENT + bytes(4 << 20),
    "items of a sequence": MARK + ELEMENT + SEQUENCE + ITEM * (1 << 19),
}


@pytest.mark.parametrize("beginning", BEGINNINGS)
def test_zip_entries_of_nothing_but_tiny_elements(tmp_path, monkeypatch, beginning):
    monkeypatch.setattr(dicom_effort, "FREE_PIECES", 10_000)
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for k in range(4):
            archive.writestr(f"{k}", BEGINNINGS[beginning])
    assert path.stat().st_size < 600_000
    assert try_file(path, "zip") == "DamagedVolumeError"


def test_slices_beside_such_entries_are_read_all_the_same(tmp_path):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("0", BEGINNINGS["commands"])
        for k, position in enumerate(axial(3)):
            archive.write(save(make_slice(position, k), tmp_path / "in" / f"{k}"), f"s{k}")
    volume = read(path)
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(3)])
    assert "0: the DICOM header cannot be read (it begins with commands" in volume.sentences[0]


@pytest.mark.parametrize("shared", ["all", "one byte"])
def test_zip_entries_that_share_bytes_are_refused(tmp_path, shared):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for k, position in enumerate(axial(3)):
            archive.write(save(make_slice(position, k), tmp_path / "in" / f"{k}"), f"{k}")
    content = bytearray(path.read_bytes())
    places = [i for i in range(len(content) - 4) if content[i : i + 4] == b"PK\1\2"]
    offsets = [int.from_bytes(content[p + 42 : p + 46], "little") for p in places]
    if shared == "all":
        struct.pack_into("<I", content, places[1] + 42, offsets[0])
    else:
        size = offsets[1] - offsets[0] - 30 + 1
        struct.pack_into("<II", content, places[0] + 20, size, size)
    path.write_bytes(content)
    with pytest.raises(DamagedVolumeError, match="zip entries 0 and 1 share bytes") as caught:
        read(path)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize(
    "packer", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA]
)
def test_every_packer_of_a_zip(tmp_path, packer):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", packer) as archive:
        for k, position in enumerate(axial(3)):
            archive.write(save(make_slice(position, k), tmp_path / "in" / f"{k}"), f"{k}")
    volume = read(path)
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(3)])
    assert volume.sentences == ()


@pytest.mark.parametrize("packer", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_an_entry_is_unpacked_no_further_than_it_is_looked_at(tmp_path, packer):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", packer) as archive:
        archive.writestr("a", bytes(1 << 20))
        entry = archive.getinfo("a")
    assert unpacked_start(path, entry, 1000) == bytes(1000)
    assert unpacked_start(path, entry, 1 << 21) == bytes(1 << 20)


def test_a_zip_of_too_many_entries_is_refused(tmp_path, monkeypatch):
    from dmc_cli.volume_io import zip_archive as dicom_zip

    monkeypatch.setattr(dicom_zip, "MAX_ENTRIES", 3)
    path = tmp_path / "a.zip"
    for count, outcome in ((3, "read"), (4, "DamagedVolumeError")):
        with zipfile.ZipFile(path, "w") as archive:
            for k, position in enumerate(axial(count)):
                archive.write(save(make_slice(position, k), tmp_path / "in" / f"{k}"), f"{k}")
        assert try_file(path, "zip") == outcome


def test_headers_have_pieces_and_bytes_in_proportion_to_what_is_stored():
    effort = Effort(400)
    for _ in range(200_100):
        effort.take_piece()
    with pytest.raises(TooMuchError):
        effort.take_piece()
    effort.take_bytes((1 << 30) + 40_000)
    with pytest.raises(TooMuchError):
        effort.take_bytes(1)


def test_a_stream_of_pieces_is_never_read_as_a_whole(monkeypatch):
    monkeypatch.setattr("dmc_cli.volume_io.dicom.effort.MOST_PIECES", 2)
    pieces = PiecewiseStream(io.BytesIO(b"abcdef"), Effort(0))
    with pytest.raises(DamagedVolumeError, match="cannot be read"):
        pieces.read()
    assert (pieces.read(0), pieces.read(2)) == (b"", b"ab")
    with pytest.raises(TooMuchError, match="more pieces"):
        pieces.read(1)


@pytest.mark.parametrize("frames", [1000, 200_000, 10**11])
def test_more_frames_than_bytes_are_refused(tmp_path, frames):
    for k, position in enumerate(axial(3)):
        path = save(make_slice(position, k, NumberOfFrames=str(frames)), tmp_path / f"{k}")
    assert try_file(path, "dicom") == "DamagedVolumeError"


def test_more_frames_than_any_input_has_are_refused(tmp_path, monkeypatch):
    for module in (dicom, dicom_storage):
        monkeypatch.setattr(module, "MAX_FRAMES", 1)
    path = save_stack(tmp_path / "plain", axial())
    assert read(path).shape == (5, 4, 4)
    values = np.array([plane_values(k) for k in range(3)])
    for k in range(2):
        dataset = make_slice((0, 0, 0), k, values=values[0], NumberOfFrames=3, SpacingBetweenSlices=1)
        dataset.PixelData = values.tobytes()
        save(dataset, tmp_path / "frames" / f"{k}")
    monkeypatch.setattr(dicom_storage, "MAX_FRAMES", 3)
    with pytest.raises(VolumeError, match="more than 1 frames found"):
        read(tmp_path / "frames")


def test_an_image_of_empty_fragments_is_refused(tmp_path):
    pytest.importorskip("openjpeg")
    for k, position in enumerate(axial(3)):
        dataset = make_slice(position, k, values=plane_values(k, "<u2", (64, 64)))
        dataset.compress(uid.JPEG2000Lossless)
        frame = next(generate_frames(dataset.PixelData, number_of_frames=1))
        dataset.PixelData = encapsulate([frame])[:12] + ITEM * 9000 + encapsulate([frame])[12:]
        path = save(dataset, tmp_path / f"{k}")
    with pytest.raises(DamagedVolumeError, match="more than 8192 fragments found for 1 frame"):
        read(path.parent)


@pytest.mark.parametrize("packer", [gzip.compress, bz2.compress])
def test_gigabytes_before_the_first_value_are_refused(tmp_path, packer):
    encoding = {gzip.compress: "gzip", bz2.compress: "bzip2"}[packer]
    packed = packer(bytes(1 << 24)) * 680
    header = f"NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nencoding: {encoding}\nendian: little\n"
    (tmp_path / "a.nrrd").write_bytes(f"{header}byte skip: {170 << 26}\n\n".encode() + packed)
    assert try_file(tmp_path / "a.nrrd", "nrrd") == "DamagedVolumeError"
    (tmp_path / "a.nrrd").write_bytes(f"{header}byte skip: {1 << 22}\n\n".encode() + packed)
    assert try_file(tmp_path / "a.nrrd", "nrrd") == "read"


OME = (
    '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0">'
    '<Pixels ID="P" DimensionOrder="XYZCT" Type="uint16" SizeX="20" SizeY="16" SizeC="1" SizeT="1" {}>'
    '<Channel ID="c" SamplesPerPixel="1"/>{}</Pixels></Image>{}</OME>'
)
LABELS = (
    '<StructuredAnnotations><XMLAnnotation ID="A" Namespace="openmicroscopy.org/omero/dimension/modulo">'
    '<Value><Modulo><ModuloAlongZ Type="other" Start="0" End="{}" Step="{}"/></Modulo></Value>'
    "</XMLAnnotation></StructuredAnnotations>"
)


def ome(path, sizes='SizeZ="6"', data='<TiffData IFD="0" PlaneCount="6"/>', more=""):
    tifffile = pytest.importorskip("tifffile")
    text = OME.format(sizes, data, more)
    tifffile.imwrite(
        path, counting((6, 16, 20), "<u2"), description=text, metadata=None, photometric="minisblack"
    )
    return path


@pytest.mark.parametrize(
    "changes",
    [
        {"sizes": 'SizeZ="100000000"'},
        {"sizes": 'SizeZ="-6"'},
        {"data": '<TiffData IFD="0" PlaneCount="100000000"/>'},
        {"data": '<TiffData IFD="0" NumPlanes="100000000"/>'},
        {"data": '<TiffData IFD="0" PlaneCount="-1"/>'},
        {"data": '<TiffData IFD="0" PlaneCount="6"/>' * 17},
        {"data": "<TiffData/>" * 17},
        {"more": LABELS.format(1e10, 1)},
        {"more": LABELS.format(10, 1e-9)},
        {"more": LABELS.format(10, 0)},
        {"more": LABELS.format("nan", 1)},
    ],
    ids=str,
)
def test_ome_metadata_that_promise_too_much(tmp_path, changes):
    assert try_file(ome(tmp_path / "a.ome.tif", **changes), "tiff") == "DamagedVolumeError"


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"data": "<TiffData/>"},
        {"data": '<TiffData IFD="0" PlaneCount="6"/>' * 16},
    ],
    ids=str,
)
def test_ome_metadata_as_they_may_be(tmp_path, changes):
    np.testing.assert_array_equal(read(ome(tmp_path / "a.ome.tif", **changes)).values, counting((6, 16, 20)))


def test_slices_that_stand_for_something_else_are_refused(tmp_path):
    with pytest.raises(UnsupportedFormatError, match="ModuloAlongZ"):
        read(ome(tmp_path / "a.ome.tif", more=LABELS.format(10, 2)))


@pytest.mark.parametrize("named", ["../b.ome.tif", "/etc/passwd", "link.tif", "pipe.tif"])
def test_ome_metadata_that_name_files_elsewhere(tmp_path, named):
    folder = tmp_path / "in"
    folder.mkdir()
    ome(tmp_path / "b.ome.tif")
    os.mkfifo(folder / "pipe.tif")
    (folder / "link.tif").symlink_to(tmp_path / "b.ome.tif")
    uuid = f'<UUID FileName="{named}">urn:uuid:1</UUID>'
    data = f'<TiffData IFD="0" PlaneCount="6">{uuid}</TiffData>'
    with pytest.raises(VolumeError, match=rf"'{named}' lies outside.*--allow-outside|regular file"):
        read(ome(folder / "a.ome.tif", data=data))


def test_links_out_of_a_folder_of_slices(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    folder = tmp_path / "in"
    folder.mkdir()
    for k in range(3):
        tifffile.imwrite(folder / f"{k}.tif", counting((16, 20), "<u2"))
    (folder / "1.tif").rename(tmp_path / "1.tif")
    (folder / "1.tif").symlink_to(tmp_path / "1.tif")
    with pytest.raises(VolumeError, match=r"1\.tif is a link out of the folder; .*--allow-outside"):
        read(folder)
    assert read(folder, allow_outside=True).shape == (20, 16, 3)
    (folder / "1.tif").unlink()
    (folder / "1.tif").symlink_to("0.tif")
    assert read(folder).shape == (20, 16, 3)


def zstd_frame(flags, told, blocks, checksum=b""):
    return b"\x28\xb5\x2f\xfd" + bytes([flags]) + told + b"".join(blocks) + checksum


def block(last, kind, size, content):
    return (last | kind << 1 | size << 3).to_bytes(3, "little") + content


@pytest.mark.parametrize(
    ("content", "size"),
    [
        (zstd_frame(0x20, b"\x07", [block(1, 0, 7, b"x" * 7)]), 7),
        (zstd_frame(0x60, b"\x07\x01", [block(1, 0, 7, b"x" * 7)]), 256 + 263),
        (zstd_frame(0xA0, b"\x07\0\0\1", [block(1, 0, 7, b"x" * 7)]), (1 << 24) + 7),
        (zstd_frame(0xE0, b"\x07\0\0\0\0\0\0\1", [block(1, 0, 7, b"x" * 7)]), (1 << 56) + 7),
        (zstd_frame(0x00, b"\x58", [block(0, 0, 7, b"x" * 7), block(1, 1, 1000, b"y")]), 1007),
        (zstd_frame(0x00, b"\x58", [block(1, 2, 5, b"x" * 5)]), 1 << 17),
        (zstd_frame(0x04, b"\x58", [block(1, 1, 10, b"y")], b"sums") * 3, 30),
        (struct.pack("<II", 0x184D2A50, 3) + b"abc" + zstd_frame(0x20, b"\x09", [block(1, 1, 9, b"y")]), 9),
        (zstd_frame(0x21, b"\x01\x09", [block(1, 1, 9, b"y")]) * 2, 18),
        (b"no zstd at all", 0),
    ],
)
def test_the_size_that_zstd_tells_is_that_of_all_its_frames(content, size):
    assert told_size("zstd", content) == size


def test_told_sizes_of_blosc_and_lz4():
    numcodecs = pytest.importorskip("numcodecs")
    for name in ("blosc", "lz4", "zstd"):
        packed = numcodecs.get_codec({"id": name}).encode(np.zeros(12_345, "u1"))
        assert told_size(name, bytes(packed)) == 12_345


def test_rle_is_read_as_far_as_its_image_can_reach(tmp_path, monkeypatch):
    """Megabytes of bytes that stand for nothing, before those of the image; and tables larger than frames."""
    for k, position in enumerate(axial(3)):
        dataset = make_slice(position, k, values=plane_values(k, "<u2", (64, 64)))
        dataset.compress(uid.RLELossless)
        frame = next(generate_frames(dataset.PixelData, number_of_frames=1))
        dataset.PixelData = encapsulate([frame[:64] + b"\x80" * (1 << 22) + frame[64:]])
        path = save(dataset, tmp_path / "bomb" / f"{k}")
    assert try_file(zip_of(path.parent), "zip") == "DamagedVolumeError"
    monkeypatch.setattr("dmc_cli.volume_io.dicom.decoding.RLE_SLACK", 64)
    values = np.array([plane_values(k, "<u2", (2, 2)) for k in range(20)])
    dataset = make_slice((0, 0, 0), 0, values=values[0], NumberOfFrames=20, ImagePositionPatient=None)
    dataset.PixelData = values.tobytes()
    dataset.compress(uid.RLELossless)
    path = save(dataset, tmp_path / "frames" / "a.dcm")
    np.testing.assert_array_equal(read(zip_of(path.parent)).values, values)


def zip_of(folder):
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.iterdir()):
            archive.write(file, file.name)
    return path
