"""docs/formats.md lists every code of a warning, as the program has them."""

import re

import pytest

from dmc_cli.notices import CODES
from tests.docs.formats import PAGE, TABLE, refreshed
from tests.docs.readme import ROOT

TEXT = PAGE.read_text("utf-8")


def test_the_tables_of_codes_are_the_programs():
    assert refreshed(TEXT) == TEXT, "run `make docs`"
    listed = [
        code for table in TABLE.finditer(TEXT) for code in re.findall(r"^\| `(W[A-Z-]+)`", table[3], re.M)
    ]
    assert sorted(listed) == sorted(CODES)


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "formats").glob("*.md")), ids=lambda page: page.stem)
def test_the_tests_that_a_page_names_are_there(page):
    text = page.read_text("utf-8")
    named = re.findall(r"`([\w/]*\.py)?(?:::(test_\w+))?`", text)
    file = ""
    for path, test in named:
        file = path or file
        source = ROOT / "tests" / "volume_io" / file
        assert source.is_file(), file
        assert f"def {test}(" in source.read_text("utf-8") or not test, f"{file}::{test}"
    assert any(test for _, test in named)


def test_every_code_that_a_page_names_is_one():
    pages = (ROOT / "docs" / "formats").glob("*.md")
    named = {code for page in pages for code in re.findall(r"W(?:-[A-Z]+)+", page.read_text("utf-8"))}
    assert named <= set(CODES)


def test_every_page_is_named():
    for page in (ROOT / "docs" / "formats").glob("*.md"):
        assert f"(formats/{page.name})" in TEXT, page.name


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "formats").glob("*.md")), ids=lambda page: page.stem)
def test_every_row_of_a_page_names_a_test(page):
    rows = [line for line in page.read_text("utf-8").splitlines() if line.startswith("|")]
    told = [row for row in rows if not re.match(r"\| (field|element|---|part)", row)]
    assert [row for row in told if not re.search(r"`[\w/]*(\.py)?(::test_\w+)?` \|$", row)] == []
