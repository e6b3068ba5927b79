"""Zips with DICOM: what of them is used, and what is said of the rest."""

import lzma
import struct
import zipfile

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, VolumeError
from dmc_cli.volume_io.dicom.effort import Effort
from dmc_cli.volume_io.dicom.source import DicomFile
from dmc_cli.volume_io.zip_archive import _can_hold, _check_apart, unpacked_start
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.reading import read

CLAIM = (1 << 30).to_bytes(4, "little")


@pytest.fixture
def slices(tmp_path):
    return [
        save(make_slice(position, k), tmp_path / "in" / f"{k}").read_bytes()
        for k, position in enumerate(axial())
    ]


def zipped(path, entries):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize(
    "name", ["../../evil.dcm", "/etc/evil.dcm", "..\\..\\evil.dcm", "C:\\evil.dcm", "a/../../evil.dcm"]
)
def test_entries_that_leave_the_zip_are_not_used(tmp_path, slices, name):
    entries = {f"a/{k}": content for k, content in enumerate(slices[:3])}
    volume = read(zipped(tmp_path / "a.zip", {**entries, name: slices[3]}))
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(3)])
    assert volume.sentences == (f"1 zip entry whose name leads out of the zip was left out: {name}",)


def test_a_zip_of_nothing_but_names_that_leave_it_is_refused(tmp_path, slices):
    path = zipped(tmp_path / "a.zip", {f"../{k}": content for k, content in enumerate(slices)})
    with pytest.raises(DamagedVolumeError, match="4 zip entries whose name leads out of the zip") as caught:
        read(path)
    assert caught.value.exit_status == 3


def test_names_with_dots_are_no_tricks(tmp_path, slices):
    path = zipped(tmp_path / "a.zip", {f"./..a/..{k}": content for k, content in enumerate(slices)})
    assert read(path).sentences == ()


@pytest.mark.parametrize("end", ["half", "no directory"])
def test_a_zip_that_was_cut_short_is_damaged(tmp_path, slices, end):
    path = zipped(tmp_path / "a.zip", {f"{k}": content for k, content in enumerate(slices)})
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2 if end == "half" else content.index(b"PK\x01\x02")])
    with pytest.raises(DamagedVolumeError, match="the zip has no directory of its entries") as caught:
        read(path)
    assert caught.value.exit_status == 3


def test_an_entry_that_claims_too_much_is_told(tmp_path, slices):
    entries = {f"{k}": content for k, content in enumerate(slices)}
    path = zipped(tmp_path / "a.zip", {**entries, "bomb.dcm": b"tiny"})
    content = path.read_bytes()
    begin = content.rindex(b"PK\x01\x02")
    path.write_bytes(content[: begin + 24] + CLAIM + content[begin + 28 :])
    assert read(path).sentences == (
        "1 zip entry that claims more bytes than it can hold was left out: bomb.dcm",
    )


def test_a_zip_of_empty_entries_tells_so(tmp_path):
    path = zipped(tmp_path / "a.zip", {f"{k}": b"" for k in range(70)})
    with pytest.raises(VolumeError, match=r"70 empty entries or folders found") as caught:
        read(path)
    assert caught.value.exit_status == 3


def test_a_header_longer_than_the_first_look_at_an_entry(tmp_path):
    entries = {}
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, ImageComments="x" * 9000)
        dataset.add_new(0x00091001, "OB", bytes(100_000))
        entries[f"{k}"] = save(dataset, tmp_path / "in" / f"{k}").read_bytes()
    volume = read(zipped(tmp_path / "a.zip", entries))
    assert volume.shape[2] == 4
    assert volume.sentences == ()


@pytest.fixture
def entry(tmp_path):
    path = zipped(tmp_path / "one.zip", {"a": b"content" * 99})
    return path, zipfile.ZipFile(path).getinfo("a")


def test_the_start_of_an_entry(entry):
    path, info = entry
    assert unpacked_start(path, info, 9) == b"contentco"
    assert unpacked_start(path, info, 99 * 7) == b"content" * 99
    info.CRC ^= 1
    assert unpacked_start(path, info, 99 * 7 - 1) == (b"content" * 99)[:-1]
    with pytest.raises(zipfile.BadZipFile, match="wrong checksum"):
        unpacked_start(path, info, 99 * 7)


def test_an_entry_that_is_not_where_it_should_be(entry):
    path, info = entry
    for place in (1, path.stat().st_size - 29):
        info.header_offset = place
        with pytest.raises(zipfile.BadZipFile, match="no entry where the zip's directory says"):
            unpacked_start(path, info, 9)


def test_an_entry_of_a_packer_that_is_not_known(entry):
    path, info = entry
    info.compress_type = 93
    with pytest.raises(NotImplementedError, match="packed by method 93; expected deflate, bzip2 or LZMA"):
        unpacked_start(path, info, 9)


@pytest.mark.parametrize("over", [0, 1])
def test_a_dictionary_of_lzma_is_so_large_at_most(tmp_path, over):
    """Its size is what a decoder allocates; 0x5D stands for the usual lc, lp and pb."""
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("a", b"content" * 99)
        info = archive.getinfo("a")
    content = bytearray((tmp_path / "a.zip").read_bytes())
    place = content.index(b"\x05\x00\x5d") + 3
    struct.pack_into("<I", content, place, (1 << 28) + over)
    (tmp_path / "a.zip").write_bytes(content)
    if not over:
        assert unpacked_start(tmp_path / "a.zip", info, 7) == b"content"
        return
    with pytest.raises(zipfile.BadZipFile, match="a dictionary of 268435457 bytes"):
        unpacked_start(tmp_path / "a.zip", info, 7)


def test_the_properties_of_lzma_are_told_apart(tmp_path):
    """lc, lp and pb of a packer that is not the usual one."""
    options = {"id": lzma.FILTER_LZMA1, "lc": 1, "lp": 2, "pb": 0, "dict_size": 1 << 16}
    packer = lzma.LZMACompressor(lzma.FORMAT_RAW, filters=[options])
    text = bytes(range(256)) * 9
    stream = packer.compress(text) + packer.flush()
    head = b"\x09\x04\x05\x00" + bytes([(0 * 5 + 2) * 9 + 1]) + (1 << 16).to_bytes(4, "little")
    info = zipfile.ZipInfo("a")
    info.compress_type, info.compress_size, info.file_size = zipfile.ZIP_LZMA, len(head + stream), len(text)
    info.header_offset, info.CRC = 5, zipfile.crc32(text)
    (tmp_path / "a").write_bytes(
        b"first" + b"PK\3\4" + bytes(22) + struct.pack("<HH", 1, 2) + b"a--" + head + stream
    )
    assert unpacked_start(tmp_path / "a", info, len(text)) == text


@pytest.mark.parametrize(
    ("size", "packed", "can"),
    [
        (1 << 32, 1 << 30, True),
        ((1 << 32) + 1, 1 << 30, False),
        (1040 * 7, 7, True),
        (1040 * 7 + 1, 7, False),
    ],
)
def test_what_an_entry_can_hold(size, packed, can):
    info = zipfile.ZipInfo("a")
    info.file_size, info.compress_size = size, packed
    assert _can_hold(info) == can


def test_more_entries_than_slices():
    info = zipfile.ZipInfo("a")
    info.header_offset, info.compress_size = 0, 0
    with pytest.raises(DamagedVolumeError, match="262145 zip entries found; expected 262144 at most"):
        _check_apart([info] * (2**18 + 1), "a.zip")
    with pytest.raises(DamagedVolumeError, match="entries a and a share bytes"):
        _check_apart([info] * 2**18, "a.zip")


@pytest.mark.parametrize("gap", [0, -1])
def test_entries_one_behind_the_other(gap):
    entries = [zipfile.ZipInfo(name) for name in "ab"]
    entries[0].header_offset, entries[0].compress_size = 100, 7
    entries[1].header_offset = 100 + 30 + 7 + gap
    if not gap:
        _check_apart(entries[::-1], "a.zip")
        return
    with pytest.raises(DamagedVolumeError, match="the zip entries a and b share bytes"):
        _check_apart(entries[::-1], "a.zip")


@pytest.mark.parametrize("packer", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_an_entry_whose_bytes_are_damaged_is_told(tmp_path, packer):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", packer) as archive:
        archive.writestr("a", bytes(range(256)) * 99)
        info = archive.getinfo("a")
    content = bytearray(path.read_bytes())
    content[40:60] = b"\xff" * 20
    path.write_bytes(content)
    with zipfile.ZipFile(path) as archive:
        file = DicomFile("a", path, info.file_size, Effort(10), archive)
        for reading in (file.open, lambda: next(file.heads())):
            with pytest.raises(DamagedVolumeError, match=r"^a: cannot be read \(.*\); get the file again"):
                reading()


def test_an_entry_is_opened_as_far_as_it_is_asked_for(entry):
    path, info = entry
    with zipfile.ZipFile(path) as archive:
        file = DicomFile("a", path, info.file_size, Effort(10), archive)
        assert file.open().read() == file.open(10**6).read() == b"content" * 99
        assert file.open(5).read() == b"conte"
        assert [head.read() for head in file.heads()] == [b"content" * 99]


def test_a_long_entry_is_looked_at_twice(tmp_path, monkeypatch):
    monkeypatch.setattr("dmc_cli.volume_io.dicom.source.HEAD_BYTES", (10, 20))
    path = zipped(tmp_path / "a.zip", {"a": bytes(10), "b": bytes(11), "c": bytes(21)})
    effort = Effort(0)
    effort._bytes = 31
    with zipfile.ZipFile(path) as archive:
        lengths = {
            name: [len(head.read()) for head in DicomFile(name, path, size, effort, archive).heads()]
            for name, size in (("a", 10), ("b", 11), ("c", 21))
        }
        assert lengths == {"a": [10], "b": [10, 11], "c": [10, 20]}
        assert effort._bytes == 0
        heads = DicomFile("c", path, 21, effort, archive).heads()
        next(heads)
        with pytest.raises(DamagedVolumeError, match="unpack to more bytes than those of images"):
            next(heads)


def test_a_zip_whose_directory_is_damaged_is_told(tmp_path, slices):
    path = zipped(tmp_path / "a.zip", {f"{k}": content for k, content in enumerate(slices)})
    content = bytearray(path.read_bytes())
    content[content.index(b"PK\1\2") + 2] = 99
    content[content.index(b"PK\1\2")] = 99
    path.write_bytes(content)
    with pytest.raises(DamagedVolumeError, match=r"a\.zip: the zip cannot be read \(Bad magic number"):
        read(path)


def test_a_folder_without_permission_is_told(tmp_path, slices, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    with pytest.raises(VolumeError, match="no permission to read the folder; check its access rights"):
        read(tmp_path / "in")


def test_a_file_without_permission_is_told(tmp_path, slices, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    with pytest.raises(VolumeError, match="no permission to read it; check the file's access rights"):
        read(tmp_path / "in" / "0", input_format="dicom")
