"""The registry of formats: every word has readers, every suffix one format."""

from dataclasses import fields, replace

import pytest

from dmc_cli.errors import SettingsError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_formats import FORMATS, VolumeFormat, format_of_suffix, known_suffixes, reader
from dmc_cli.volume_io import raw
from tests.volume_io.reading import read


def test_other_formats_are_refused_with_the_list():
    with pytest.raises(SettingsError, match=f"input_format is 'jpeg'; expected one of {', '.join(FORMATS)}$"):
        ReadSettings(input_format="jpeg")


@pytest.fixture
def toy(monkeypatch, tmp_path):
    """A format by its entry alone: a word, then raw values."""

    def layout(path, name, settings):
        settings = replace(settings, shape=(2, 3, 4), dtype="uint8", skip_bytes=3)
        return replace(raw.raw_layout(path, name, settings), format="toy")

    entry = VolumeFormat(
        title="Toy",
        suffixes=(".toy",),
        begins=lambda start: start.startswith(b"toy"),
        options=("spacing",),
        layout="raw:toy_layout",
    )
    monkeypatch.setattr(raw, "toy_layout", layout, raising=False)
    monkeypatch.setitem(FORMATS, "toy", entry)
    (tmp_path / "a.toy").write_bytes(b"toy" + bytes(range(24)))
    return tmp_path / "a.toy"


def test_an_entry_makes_a_format(toy):
    by_suffix = read(toy)
    assert (by_suffix.format, by_suffix.values.ravel().tolist()) == ("toy", list(range(24)))
    by_content = read(toy.rename(toy.with_suffix("")))
    assert by_content.format == "toy"
    chosen = read(toy.with_suffix(""), input_format="toy", spacing=(1, 2, 3), origin=(0, 0, 0), series="1")
    assert not any("--spacing" in told for told in chosen.sentences)
    assert chosen.sentences[0] == "--origin has no effect: the file tells its own"
    assert "--series has no effect on toy input; it is for dicom" in chosen.sentences
    toy.with_suffix(".xyz").write_bytes(b"some text")
    with pytest.raises(UnsupportedFormatError, match=r"\.toy, "):
        read(toy.with_suffix(".xyz"))


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_is_read_in_one_way(name):
    known = FORMATS[name]
    assert bool(known.layout) != bool(known.read)
    assert bool(known.entries) == bool(known.read)
    for place in (known.layout, known.read, known.entries):
        assert not place or callable(reader(place))


def test_no_suffix_means_two_formats():
    assert len(known_suffixes()) == len(set(known_suffixes()))
    assert all(suffix == suffix.lower() for suffix in known_suffixes())


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("a.nii.gz", "nifti"),
        ("A.NII", "nifti"),
        ("a.raw.gz", "raw"),
        ("a.gz", None),
        ("a", None),
        ("a.IMA", "dicom"),
    ],
)
def test_the_longest_suffix_counts(name, found):
    assert format_of_suffix(name) == found


def test_a_format_names_options_that_there_are():
    known = {field.name for field in fields(ReadSettings)}
    assert all(set(entry.options) <= known for entry in FORMATS.values())


def test_a_format_that_is_read_from_pieces_and_tells_no_beginning_is_no_stream():
    assert [name for name, entry in FORMATS.items() if entry.read and not _tells_its_beginning(entry)] == [
        "parrec",
        "zarr",
    ]


def _tells_its_beginning(entry):
    return any(test is not VolumeFormat.begins for test in (entry.begins, entry.may_begin))
