"""The registry of formats: every word has readers, every suffix one format."""

from typing import get_args

import pytest

from dmc_cli import settings
from dmc_cli.volume_io.formats import FORMATS, format_of_suffix, known_suffixes, reader


def test_the_words_are_those_of_the_option():
    assert set(FORMATS) == set(get_args(settings.InputFormat))


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
