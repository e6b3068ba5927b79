"""Studies of many files: of each header only what is asked for is read and kept, whatever else there is."""

import re
import tracemalloc
from pathlib import Path

import pytest
from pydicom.datadict import dictionary_VR
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import survey_volumes
from dmc_cli.volume_io.dicom import flat, header, reader
from dmc_cli.volume_io.dicom.effort import FREE_PIECES, Effort
from dmc_cli.volume_io.dicom.header import read_header
from dmc_cli.volume_io.dicom.reader import dicom_entries
from dmc_cli.volume_io.dicom.source import DicomFile
from dmc_cli.volume_io.dicom.wanted import COMPLEX, WANTED
from tests.volume_io.dicom.scanner import axial, make_slice, save
from tests.volume_io.reading import read

SYNTAXES = [ExplicitVRLittleEndian, ImplicitVRLittleEndian]


def long_slice(position, k, **options):
    """A slice with private elements longer than its pixels, and nested sequences without lengths."""
    dataset = make_slice(position, k, **options)
    block = dataset.private_block(0x0029, "SIEMENS CSA HEADER", create=True)
    block.add_new(0x10, "OB", bytes(50_000))
    block.add_new(0x20, "OB", bytes(50_000))
    code = Dataset()
    code.CodeValue = "1"
    inner = Dataset()
    inner.ScheduledProtocolCodeSequence = Sequence([code, Dataset()])
    inner.Rows = 7
    dataset.RequestAttributesSequence = Sequence([inner, Dataset(inner)])
    dataset.ReferencedImageSequence = Sequence([])
    for holder, name in (
        (dataset, "RequestAttributesSequence"),
        (dataset, "ReferencedImageSequence"),
        (inner, "ScheduledProtocolCodeSequence"),
    ):
        holder[name].is_undefined_length = True
        for item in holder[name].value:
            item.is_undefined_length_sequence_item = True
    return dataset


@pytest.mark.parametrize("syntax", SYNTAXES)
def test_long_headers_are_read_without_pydicom_and_in_windows(tmp_path, monkeypatch, syntax):
    for k, position in enumerate(axial()):
        save(long_slice(position, k, syntax=syntax), tmp_path / f"{k}")
    expected = read(tmp_path)
    monkeypatch.setattr(header, "_parsed", None)
    read_bytes = 0

    class Counted(flat.FlatScanner):
        def _move(self, begin):
            nonlocal read_bytes
            found = super()._move(begin)
            read_bytes += len(self._data)
            return found

    monkeypatch.setattr(header, "FlatScanner", Counted)
    found = read(tmp_path)
    assert (found.values == expected.values).all()
    assert found.shape == (5, 4, 4)
    assert 0 < read_bytes <= 4 * 4 * flat.WINDOW < 4 * 100_000


@pytest.mark.parametrize("syntax", SYNTAXES)
@pytest.mark.parametrize("make", [make_slice, long_slice])
def test_a_header_is_the_same_without_pydicom_and_by_it(tmp_path, monkeypatch, syntax, make):
    path = save(make(axial()[1], 1, syntax=syntax, EchoTime="20", PixelPaddingValue=3), tmp_path / "a")
    file = DicomFile("a", path, path.stat().st_size, Effort(path.stat().st_size))
    plain = read_header(file)
    monkeypatch.setattr(header, "_flat_header", lambda *_: None)
    parsed = read_header(file)
    assert isinstance(plain.dataset, flat.FlatDataset)
    assert not isinstance(parsed.dataset, flat.FlatDataset)
    assert plain.pixel_start == parsed.pixel_start
    assert plain.syntax == parsed.syntax
    kept = {tag: element.value for tag, element in plain.dataset.items()}
    by_pydicom = {int(tag): parsed.dataset.get_item(tag).value for tag in parsed.dataset.keys()}  # noqa: SIM118
    by_pydicom.pop(0x00080005, None)
    assert kept == by_pydicom


@pytest.mark.parametrize("place", [0, 1, 2, 3])
def test_sequences_that_do_not_end_are_left_to_pydicom(tmp_path, place):
    """Delimiters in places where none should be, and files that are cut short."""
    path = save(long_slice(axial()[0], 0), tmp_path / "a")
    content = path.read_bytes()
    ends = [found.start() for found in re.finditer(b"\xfe\xff[\r\xdd]\xe0", content)]
    where = ends[place]
    path.write_bytes(content[:where] + b"\xfe\xff\x77\xe0" + content[where + 4 :])
    with path.open("rb") as stream:
        scanner = flat.FlatScanner(stream, 132)
        assert scanner.scan(explicit=True)[1] > 0
        assert scanner.scan(explicit=True)[1] == -1


@pytest.mark.parametrize("syntax", SYNTAXES)
def test_each_file_keeps_few_bytes(tmp_path, monkeypatch, syntax):
    """5000 files of 100 kB of private elements each would not fit into the 300 MB that 20 kB a file make."""
    count = 60
    for k in range(count):
        position = (0.0, 0.0, k % 6)
        dataset = long_slice(position, k, syntax=syntax, TemporalPositionIdentifier=str(1 + k // 6))
        save(dataset, tmp_path / f"{k:03}")
    opened = []
    original = DicomFile.open
    monkeypatch.setattr(DicomFile, "open", lambda self, *a: opened.append(self.name) or original(self, *a))
    dicom_entries(tmp_path, "warm up", ReadSettings())
    opened.clear()
    tracemalloc.start()
    try:
        entries = dicom_entries(tmp_path, "study", ReadSettings())
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert [entry.size for entry in entries] == [(5, 4, 6)] * 10
    assert peak < 20_000 * count
    assert sorted(opened) == [f"{k:03}" for k in range(count)]


def test_one_volume_of_many_reads_the_pixels_of_its_own_files(tmp_path, monkeypatch):
    for k in range(12):
        dataset = make_slice((0.0, 0.0, k % 4), k, TemporalPositionIdentifier=str(1 + k // 4))
        save(dataset, tmp_path / f"{k:03}")
    opened = []
    original = DicomFile.open
    monkeypatch.setattr(DicomFile, "open", lambda self, *a: opened.append(self.name) or original(self, *a))
    assert read(tmp_path, series="2").shape == (5, 4, 4)
    again = {name for name in opened if opened.count(name) > 1}
    assert again == {f"{k:03}" for k in range(4, 8)}


@pytest.mark.parametrize("volumes", [1, 3])
def test_a_survey_reads_each_header_once(tmp_path, monkeypatch, volumes):
    """Where one volume is left its pixels are read, too; its header is not read again."""
    for k in range(4 * volumes):
        dataset = make_slice((0.0, 0.0, k % 4), k, TemporalPositionIdentifier=str(1 + k // 4))
        save(dataset, tmp_path / f"{k:03}")
    headers, reading = [], reader.read_header
    monkeypatch.setattr(reader, "read_header", lambda file: headers.append(file.name) or reading(file))
    entries, volume = survey_volumes(str(tmp_path), ReadSettings())
    assert len(entries) == volumes
    assert (volume is None) == (volumes > 1)
    assert sorted(headers) == [f"{k:03}" for k in range(4 * volumes)]


def test_every_element_that_is_asked_for_is_kept():
    """Sequences within functional groups are kept with these."""
    nested = {0x00189076, 0x004008EA, 0x0062000A}
    asked = {
        int(found, 16)
        for path in Path(header.__file__).parent.glob("*.py")
        if path.name not in ("wanted.py", "flat.py")
        for found in re.findall(r"0x[0-9A-F]{8}\b", path.read_text(encoding="utf-8"))
    }
    elements = {tag for tag in asked if 0x00020000 < tag < 0x7FE00000}
    groups = {tag for tag in elements if dictionary_VR(tag) == "SQ" and tag & 0xFFFF >= 0x9000}
    assert elements - groups - nested - COMPLEX <= WANTED


def test_elements_that_are_passed_count():
    effort = Effort(0)
    effort.take_pieces(FREE_PIECES)
    with pytest.raises(Exception, match="more pieces"):
        effort.take_pieces(1)
