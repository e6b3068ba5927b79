"""Zips with DICOM: what of them is used, and what is said of the rest."""

import zipfile

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, VolumeError
from tests.volume.reading import read
from tests.volume.scanner import axial, make_slice, plane_values, save

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
    assert volume.warnings == (f"1 zip entry whose name leads out of the zip was left out: {name}",)


def test_a_zip_of_nothing_but_names_that_leave_it_is_refused(tmp_path, slices):
    path = zipped(tmp_path / "a.zip", {f"../{k}": content for k, content in enumerate(slices)})
    with pytest.raises(DamagedVolumeError, match="4 zip entries whose name leads out of the zip") as caught:
        read(path)
    assert caught.value.exit_status == 3


def test_names_with_dots_are_no_tricks(tmp_path, slices):
    path = zipped(tmp_path / "a.zip", {f"./..a/..{k}": content for k, content in enumerate(slices)})
    assert read(path).warnings == ()


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
    assert read(path).warnings == (
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
    assert volume.warnings == ()
