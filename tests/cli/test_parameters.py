"""Words on the command line, and what a TOML file holds, become values."""

import click
import pytest

from dmc_cli.cli.parameters import ChoiceList, Size, Triple


@pytest.mark.parametrize(
    ("word", "size"),
    [
        ("0", 0),
        ("7", 7),
        ("1K", 1 << 10),
        ("1k", 1 << 10),
        ("2KiB", 2 << 10),
        ("3MB", 3 << 20),
        (" 1.5 G ", 3 << 29),
        ("1T", 1 << 40),
        ("5B", 5),
        (12345, 12345),
    ],
)
def test_sizes(word, size):
    assert Size().convert(word, None, None) == size


@pytest.mark.parametrize(
    "word", ["", "G", "4X", "-1", "1.G", ".5G", "1..5", "4G4", "4GG", "9" * 400, "9" * 305 + "T"]
)
def test_what_is_no_size(word):
    with pytest.raises(click.BadParameter, match="is no size; expected a number of bytes, as in 4G or 500M"):
        Size().convert(word, None, None)


@pytest.mark.parametrize(
    ("number", "value", "triple"),
    [
        (int, "64,65,93", (64, 65, 93)),
        (float, "0.5,1,2e-3", (0.5, 1.0, 0.002)),
        (int, [1, 2, 3], (1, 2, 3)),
        (float, (1, 2.5, 3), (1.0, 2.5, 3.0)),
    ],
)
def test_triples(number, value, triple):
    found = Triple(number).convert(value, None, None)
    assert found == triple
    assert all(type(item) is number for item in found)


@pytest.mark.parametrize(
    ("number", "value", "message"),
    [
        (int, "1,2", "'1,2' has 2 part.s.; expected three integers"),
        (float, "1,2,3,4", "has 4 part.s.; expected three numbers"),
        (int, "1,2,3.5", "'1,2,3.5': expected three integers"),
        (float, "1,2,x", "'1,2,x': expected three numbers"),
    ],
)
def test_what_is_no_triple(number, value, message):
    with pytest.raises(click.BadParameter, match=message):
        Triple(number).convert(value, None, None)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("b,a", ("b", "a")),
        (" a , b ,", ("a", "b")),
        ("a,a,b", ("a", "b")),
        (["b", "a"], ("b", "a")),
        ((), ()),
        ("", ()),
    ],
)
def test_lists_of_words(value, words):
    assert ChoiceList(("a", "b")).convert(value, None, None) == words


def test_a_word_that_is_not_on_the_list_is_named():
    with pytest.raises(click.BadParameter, match="'c' is not one of a, b"):
        ChoiceList(("a", "b")).convert("a,c", None, None)
