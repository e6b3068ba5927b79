"""Tars: what of their entries is used, what is said of the rest, and what they may take."""

import io
import sys
import tarfile
import zipfile

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, DmcError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import tar_archive, unarchived
from dmc_cli.volume_io.read import check_input, read_volume, survey_volumes
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.reading import counting, read
from tests.volume_io.test_packed import PACKERS

VALUES = counting((3, 4, 5), "<i2")
NRRD = b"NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nencoding: raw\nendian: little\n"
PLACE = b"space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n\n"
SCAN = NRRD + PLACE + VALUES.tobytes()


def tarred(path, entries, **options):
    """A tar of files by their names, or of entries as tarfile has them."""
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w", **options) as archive:
        for name, entry in entries.items():
            info, data = (tarfile.TarInfo(name), entry) if isinstance(entry, bytes) else (entry, b"")
            info.name, info.size = name, len(data)
            archive.addfile(info, io.BytesIO(data))
    path.write_bytes(content.getvalue())
    return path


def special(kind, target=""):
    info = tarfile.TarInfo()
    info.type, info.linkname = kind, target
    return info


FORMATS = {"ustar": tarfile.USTAR_FORMAT, "gnu": tarfile.GNU_FORMAT, "pax": tarfile.PAX_FORMAT}


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("suffix", ["", *PACKERS])
def test_a_tar_of_any_kind_is_read_packed_or_not(tmp_path, kind, suffix):
    name = "a folder of a long name/" * 6 + "ü/scan.nrrd"
    path = tarred(tmp_path / "a.tar", {name: SCAN, "readme.txt": b"x"}, format=FORMATS[kind])
    if suffix:
        (tmp_path / f"b.tar{suffix}").write_bytes(PACKERS[suffix](path.read_bytes()))
        path = tmp_path / f"b.tar{suffix}"
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert (volume.format, volume.files) == ("nrrd", (path,))
    check_input(str(path), ReadSettings())


@pytest.mark.parametrize("name", ["a.tgz", "a.tbz2", "a.txz", "a.tzst", "a", "a.tar"])
def test_a_packed_tar_is_known_by_its_content(tmp_path, name):
    packer = {"b": ".bz2", "x": ".xz", "z": ".zst"}.get(name[3:4], ".gz")
    path = tarred(tmp_path / "all", {"scan.nrrd": SCAN})
    (tmp_path / name).write_bytes(PACKERS[packer](path.read_bytes()))
    np.testing.assert_array_equal(read(tmp_path / name).values, VALUES)


def test_a_tar_from_standard_input_is_read(tmp_path, monkeypatch):
    for pack in (bytes, PACKERS[".gz"]):
        content = io.BytesIO(pack(tarred(tmp_path / "a.tar", {"scan.nrrd": SCAN}).read_bytes()))
        monkeypatch.setattr(sys, "stdin", type("Stdin", (), {"buffer": content}))
        np.testing.assert_array_equal(read_volume("-", ReadSettings()).values, VALUES)


@pytest.mark.parametrize("suffix", ["", ".gz"])
def test_a_tar_of_dicom_is_read(tmp_path, suffix):
    slices = {
        f"study/{k}": save(make_slice(position, k), tmp_path / f"{k}").read_bytes()
        for k, position in enumerate(axial(4))
    }
    path = tarred(tmp_path / "a.tar", slices)
    if suffix:
        path = tmp_path / "a.tar.gz"
        path.write_bytes(PACKERS[suffix]((tmp_path / "a.tar").read_bytes()))
    (entry,), volume = survey_volumes(str(path), ReadSettings())
    assert (entry.size, volume.format, volume.files) == (volume.shape, "dicom", (path,))
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(4)])


@pytest.mark.parametrize(
    "name", ["../../out.nrrd", "/tmp/out.nrrd", "..\\out.nrrd", "C:\\out.nrrd", "a/../../o.nrrd"]
)
def test_entries_that_lead_out_are_not_unpacked(tmp_path, name):
    path = tarred(tmp_path / "a.tar", {"scan.nrrd": SCAN, name: b"x"})
    volume = read(path)
    assert volume.sentences == (f"1 tar entry whose name leads out of the tar was left out: {name}",)
    assert [notice.code for notice in volume.warnings] == ["W-FILES-LEFT-OUT"]


@pytest.mark.parametrize(
    "kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.CHRTYPE, tarfile.BLKTYPE]
)
def test_links_and_devices_are_not_unpacked_but_told(tmp_path, kind):
    path = tarred(tmp_path / "a.tar", {"scan.nrrd": SCAN, "b.nrrd": special(kind, "/etc/passwd")})
    assert read(path).sentences == ("1 tar entry that is a link, a pipe or a device was left out: b.nrrd",)


def test_a_file_through_a_link_is_written_into_the_tars_own_folder(tmp_path):
    """The link is not made, so that nothing is written where it leads."""
    (tmp_path / "out").mkdir()
    entries = {"deep": special(tarfile.SYMTYPE, str(tmp_path / "out")), "deep/scan.nrrd": SCAN}
    np.testing.assert_array_equal(read(tarred(tmp_path / "a.tar", entries)).values, VALUES)
    assert not list((tmp_path / "out").iterdir())


def test_the_last_entry_of_a_name_counts(tmp_path):
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w") as archive:
        for data in (b"another", SCAN):
            info = tarfile.TarInfo("scan.nrrd")
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    (tmp_path / "a.tar").write_bytes(content.getvalue())
    np.testing.assert_array_equal(read(tmp_path / "a.tar").values, VALUES)


def test_a_file_where_a_folder_is_is_refused(tmp_path):
    path = tarred(tmp_path / "a.tar", {"a": SCAN, "a/b": SCAN})
    with pytest.raises(DamagedVolumeError, match="entry a/b cannot be unpacked"):
        read(path)


def test_a_tar_that_is_cut_anywhere_is_refused(tmp_path):
    """Where an entry ends, too: tarfile takes that for the end."""
    content = tarred(
        tmp_path / "all", {f"s{k}.raw": bytes(700) for k in range(3)} | {"a.nrrd": SCAN}
    ).read_bytes()
    path = tmp_path / "a.tar"
    end = 3 * (512 + 1024) + 2 * 512
    for length in (*range(513, end, 256), 512, 1536, 3 * 1536, end):
        path.write_bytes(content[:length])
        with pytest.raises(DamagedVolumeError, match=r"a\.tar"):
            read(path)


def test_a_tar_with_a_damaged_header_in_it_is_refused(tmp_path):
    """What follows it would be left out in silence."""
    content = bytearray(
        tarred(tmp_path / "all", {"a.nrrd": SCAN, "b.txt": b"x", "c.nrrd": SCAN}).read_bytes()
    )
    content[1024 + 20] ^= 255
    (tmp_path / "a.tar").write_bytes(content)
    with pytest.raises(DamagedVolumeError, match="ends, or is damaged, behind 1 entries"):
        read(tmp_path / "a.tar")


def test_a_tar_that_unpacks_to_far_more_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(unarchived, "FREE_BYTES", 1 << 10)
    info = tarfile.TarInfo("a.npy")
    info.size = 1 << 40  # all of it is a hole
    info.pax_headers = {"GNU.sparse.major": "1", "GNU.sparse.minor": "0", "GNU.sparse.realsize": str(1 << 40)}
    header = info.tobuf(tarfile.PAX_FORMAT)
    path = tmp_path / "a.tar"
    path.write_bytes(header + b"0\n".ljust(512, b"\0") + bytes(1024))
    with pytest.raises(DamagedVolumeError):
        read(path)
    path = tmp_path / "b.tgz"
    path.write_bytes(PACKERS[".gz"](tarred(tmp_path / "b", {"a.npy": bytes(10_000_000)}).read_bytes()))
    with pytest.raises(DamagedVolumeError, match="that unpacks to 10000000; expected at most"):
        read(path)


def bomb(kind, content, count=1):
    """A tar of entries before each of which stands something that tarfile reads as a whole."""
    head = special(kind)
    head.name, head.size = "x", len(content)
    padded = content + bytes(-len(content) % 512)
    return (head.tobuf() + padded + tarfile.TarInfo("a").tobuf()) * count + bytes(1024)


BOMBS = {
    "a long name": bomb(tarfile.GNUTYPE_LONGNAME, bytes(1 << 23)),
    "a long header": bomb(tarfile.XHDTYPE, b"9 a=1234\n" * (1 << 18)),
    "many fields": bomb(tarfile.XHDTYPE, b"5 a=\n" * 10_000, 20),
    "many digits": bomb(tarfile.XHDTYPE, b"1" * 1_000_000, 10),
    "fields for all": b"".join(bomb(tarfile.XGLTYPE, f"14 a{k:07}=\n".encode())[:-1024] for k in range(1100)),
    "many additions": bomb(tarfile.XHDTYPE, b"1" * 50 + b" " * 900_000, 3),
    "headers of headers": bomb(tarfile.XHDTYPE, b"9 a=1234\n")[:1024] * 2500,
    "many entries": tarfile.TarInfo("a").tobuf() * 4_000,
}


@pytest.mark.parametrize("kind", BOMBS)
def test_headers_of_a_tar_take_neither_memory_nor_time(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(tar_archive, "FREE_BYTES", 1 << 21)
    monkeypatch.setattr(tar_archive, "FREE_ENTRIES", 1 << 11)
    path = tmp_path / "a.tgz"
    path.write_bytes(PACKERS[".gz"](BOMBS[kind], 1))
    with pytest.raises(DamagedVolumeError, match=r"a\.tgz: the tar cannot be read"):
        read(path)


def test_as_many_entries_as_there_may_be_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(tar_archive, "MAX_ENTRIES", 3)
    entries = {f"{k}.txt": b"x" for k in range(2)} | {"a.nrrd": SCAN}
    assert read(tarred(tmp_path / "a.tar", entries)).shape == (5, 4, 3)
    with pytest.raises(DamagedVolumeError, match="more entries"):
        read(tarred(tmp_path / "b.tar", entries | {"c.txt": b"x"}))


@pytest.mark.parametrize("outer", ["zip", "tar", "tgz", "folder"])
@pytest.mark.parametrize("inner", ["a.zip", "deep/a.tar", "a.tar.gz", "a.tgz"])
def test_an_archive_in_an_archive_is_refused_in_words(tmp_path, outer, inner):
    path = tmp_path / f"o.{outer}"
    if outer == "folder":
        (path / inner).parent.mkdir(parents=True)
        (path / inner).write_bytes(b"whatever")
    elif outer == "zip":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr(inner, b"whatever")
            archive.writestr("readme.txt", b"x")
    else:
        tarred(path, {inner: b"whatever", "readme.txt": b"x"})
    with pytest.raises(
        UnsupportedFormatError, match=rf"nothing but an archive found in it \(.*{inner[-5:]}\).*unpack it"
    ):
        read(path)


def test_an_archive_beside_a_volume_is_named(tmp_path):
    path = tarred(tmp_path / "a.tar", {"scan.nrrd": SCAN, "old.zip": b"PK\3\4"})
    assert read(path).sentences == ("1 file was left out: old.zip",)


def zipped(path, entries):
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize("archiver", [zipped, tarred])
def test_the_format_that_is_named_is_that_of_the_file_in_an_archive(tmp_path, archiver):
    path = archiver(tmp_path / "a.zip", {"values.bin": VALUES.tobytes(), "readme.txt": b"x"})
    volume = read(path, input_format="raw", shape=(5, 4, 3), dtype="int16")
    np.testing.assert_array_equal(volume.values, VALUES)
    path = archiver(tmp_path / "b.zip", {"scan": SCAN})
    np.testing.assert_array_equal(read(path, input_format="nrrd").values, VALUES)
    path = archiver(tmp_path / "c.zip", {"one": SCAN, "two": SCAN})
    with pytest.raises(AmbiguousVolumeError, match=r"2 files found that may be nrrd \(one, two\)"):
        read(path, input_format="nrrd")


def test_a_tar_with_nothing_in_it_is_refused(tmp_path):
    for entries in ({}, {"folder": special(tarfile.DIRTYPE)}, {"readme.txt": b"x"}):
        with pytest.raises(DmcError, match=r"a\.tar") as caught:
            read(tarred(tmp_path / "a.tar", entries))
        assert caught.value.exit_status == 3
