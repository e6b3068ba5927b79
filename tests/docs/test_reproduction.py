"""docs/reproduction.md tells what is found: its tables are those of the kept results, these the program's."""

from tests.docs.reproduction import PAGE, PART, found_rows, refreshed


def test_the_page_shows_what_was_kept():
    text = PAGE.read_text("utf-8")
    assert refreshed(text) == text, "run `make docs`"
    assert [match[2] for match in PART.finditer(text)] == ["summary", *(f"table {n}" for n in "346789I")]


def test_every_figure_is_found_as_printed_or_told_why():
    for row in found_rows():
        if row.value.expectation == "exact":
            assert row.agrees, row.value
        assert row.reason not in ("not explained", "not made"), row.value
        assert not (row.value.expectation == "misprint" and row.agrees), row.value
