"""Zips and tars of whatever is read as a file or a folder, and folders that hold one volume."""

import gzip
import io
import shutil
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, SettingsError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import unarchived
from dmc_cli.volume_io.read import list_volumes
from tests.fuzz.honest import HONEST
from tests.volume_io.dicom.scanner import axial, make_slice, save
from tests.volume_io.reading import counting, read
from tests.volume_io.test_packed import PACKERS


def zipped(path, folder):
    """A zip of all files below a folder."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.rglob("*")):
            archive.write(file, file.relative_to(folder))
    return path


def tarred(path, folder):
    """A tar of all files below a folder, packed as the suffix says."""
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w") as archive:
        archive.add(folder, ".")
    pack = PACKERS.get({".tgz": ".gz"}.get(path.suffix, path.suffix), bytes)
    path.write_bytes(pack(content.getvalue()))
    return path


ARCHIVERS = {"a zip": (zipped, "one.zip"), "a tar": (tarred, "one.tar"), "a packed tar": (tarred, "one.tgz")}


def honest(reader, folder):
    """A folder with the first honest volume of a reader, and the file."""
    for package in {"minc": ["h5py"], "tiff": ["tifffile"]}.get(reader, []):
        pytest.importorskip(package)
    path = HONEST[reader](folder / "all")[0] if (folder / "all").mkdir() is None else None
    inside = folder / "in"
    inside.mkdir()
    pair = path.parent.glob(f"{path.stem}.*") if reader in ("afni", "analyze", "parrec") else [path]
    for file in pair:
        shutil.copy(file, inside)
    return inside, inside / path.name


READERS = ["nifti", "nrrd", "meta", "mgh", "minc", "numpy", "tiff", "afni", "analyze", "parrec"]


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", ["a folder", *ARCHIVERS, "a zip of a folder", "a tar of a folder"])
def test_one_volume_of_any_kind_is_read(tmp_path, reader, kind):
    folder, path = honest(reader, tmp_path)
    plain = read(path)
    source = folder
    if kind != "a folder":
        archiver, name = ARCHIVERS[kind.removesuffix(" of a folder")]
        source = archiver(tmp_path / name, folder if kind in ARCHIVERS else _inside(folder))
    volume = read(source)
    np.testing.assert_array_equal(volume.values, plain.values)
    np.testing.assert_array_equal(volume.affine, plain.affine)
    assert (volume.format, volume.space) == (plain.format, plain.space)
    if kind != "a folder":
        assert volume.files == (source,)
    (entry,) = list_volumes(str(source), ReadSettings())
    assert entry.size == plain.shape


def _inside(folder):
    """Put a folder into another one, beside what a Mac leaves."""
    outer = folder.parent / "outer"
    shutil.move(folder, outer / "scan")
    (outer / "__MACOSX").mkdir()
    (outer / "__MACOSX" / "._a.nii").write_bytes(b"\0\5\x16\7")
    (outer / ".DS_Store").write_bytes(b"x")
    return outer


@pytest.mark.parametrize("name", ["s{}.png", "scan/s{}.png"])
def test_a_zip_of_slices_is_read(tmp_path, name):
    images = pytest.importorskip("PIL.Image")
    values = counting((4, 6, 7), "u1")
    for k, plane in enumerate(values):
        path = tmp_path / "in" / name.format(k + 8)
        path.parent.mkdir(parents=True, exist_ok=True)
        images.fromarray(plane).save(path)
    (path.parent / "s.log").write_text("Pixel Size (um)=20\n")
    volume = read(zipped(tmp_path / "a.zip", tmp_path / "in"))
    np.testing.assert_array_equal(volume.values, values)
    assert volume.spacing == pytest.approx((0.02,) * 3)


def test_a_zipped_zarr_store_is_read(tmp_path):
    zarr = pytest.importorskip("zarr")
    values = counting((4, 6, 7), "<i2")
    zarr.create_array(tmp_path / "a.zarr", data=values, zarr_format=2)
    for root in (tmp_path / "a.zarr", tmp_path):
        volume = read(zipped(tmp_path.parent / f"{tmp_path.name}.zip", root))
        np.testing.assert_array_equal(volume.values, values)
        assert volume.format == "zarr"


def test_what_most_files_are_wins_in_a_zip_and_a_folder(tmp_path):
    folder, _ = honest("nrrd", tmp_path)
    save(make_slice(axial(3)[0], 0), folder / "1")
    for source in (folder, zipped(tmp_path / "a.zip", folder)):
        with pytest.raises(VolumeError, match="no two slices of one volume"):  # as many: DICOM
            read(source)
    for k, position in enumerate(axial(3)):
        save(make_slice(position, k), folder / f"{k}")
    for source in (folder, zipped(tmp_path / "a.zip", folder)):
        assert read(source).format == "dicom"


def test_several_volumes_in_a_folder_or_zip_are_listed(tmp_path):
    folder, path = honest("nrrd", tmp_path)
    (folder / "b.nrrd.gz").write_bytes(gzip.compress(path.read_bytes()))
    for source in (folder, zipped(tmp_path / "a.zip", folder)):
        with pytest.raises(AmbiguousVolumeError, match=rf"2 volumes .*b.nrrd.gz, {path.name}.*give the file"):
            read(source)


def test_a_file_beside_the_only_volume_is_named(tmp_path):
    folder, path = honest("nifti", tmp_path)
    (folder / "readme.txt").write_text("of use to people")
    volume = read(folder)
    assert volume.warnings[0].code == "W-FILES-LEFT-OUT"
    assert "readme.txt" in volume.warnings[0].sentence
    assert volume.files == (path,)


def test_a_zip_that_unpacks_to_far_more_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(unarchived, "FREE_BYTES", 1 << 10)
    np.save(tmp_path / "a.npy", np.zeros((100, 100, 100), "u1"))
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(tmp_path / "a.npy", "a.npy")
    with pytest.raises(DamagedVolumeError, match="that unpacks to 1000128; expected at most"):
        read(tmp_path / "a.zip")


def test_a_damaged_entry_is_told_by_its_name(tmp_path):
    folder, path = honest("nrrd", tmp_path)
    source = zipped(tmp_path / "a.zip", folder)
    content = bytearray(source.read_bytes())
    content[60:70] = bytes(10)
    source.write_bytes(content)
    with pytest.raises(DamagedVolumeError, match=rf"archive's entry {path.name} cannot be unpacked"):
        read(source)


def test_entries_that_lead_out_are_not_unpacked(tmp_path):
    folder, path = honest("nrrd", tmp_path)
    source = zipped(tmp_path / "a.zip", folder)
    with zipfile.ZipFile(source, "a") as archive:
        archive.writestr("../../out.nrrd", path.read_bytes())
    volume = read(source)
    assert any("leads out of the zip" in notice.sentence for notice in volume.warnings)
    assert not (Path(tmp_path).parent / "out.nrrd").exists()


def test_nothing_is_left_of_a_zip(tmp_path, monkeypatch):
    folder, _ = honest("nrrd", tmp_path)
    source = zipped(tmp_path / "a.zip", folder)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    read(source)
    assert not list((tmp_path / "temporary").iterdir())


def test_a_text_beside_the_only_folder_is_named(tmp_path):
    folder, path = honest("nifti", tmp_path)
    outer = tmp_path / "outer"
    shutil.copytree(folder, outer / "scan")
    (outer / "readme.txt").write_text("of use to people")
    (outer / "scan.log").write_text("of use to the scanner")
    for source in (outer, zipped(tmp_path / "a.zip", outer)):
        volume = read(source)
        np.testing.assert_array_equal(volume.values, read(path).values)
        told = "2 files were left out: readme.txt, scan.log"
        assert told in [notice.sentence for notice in volume.warnings]


def test_volumes_in_several_folders_are_listed(tmp_path):
    folder, path = honest("nrrd", tmp_path)
    outer = tmp_path / "outer"
    for name in ("one", "two"):
        shutil.copytree(folder, outer / name)
    for source in (outer, zipped(tmp_path / "a.zip", outer)):
        with pytest.raises(
            AmbiguousVolumeError, match=rf"2 folders found with volumes or images.*one/{path.name}, two/"
        ):
            read(source)


def test_a_raw_file_alone_is_read_as_the_options_say(tmp_path):
    values = np.arange(4 * 5 * 6, dtype="u1").reshape(4, 5, 6)
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "a.raw").write_bytes(values.tobytes())
    for source in (folder, zipped(tmp_path / "a.zip", folder)):
        volume = read(source, shape=(6, 5, 4), dtype="uint8")
        np.testing.assert_array_equal(volume.values, values)
        with pytest.raises(SettingsError, match="--shape"):
            read(source)
