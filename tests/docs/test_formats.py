"""docs/formats.md lists every code of a warning, as the program has them."""

import re

from dmc_cli.notices import CODES
from tests.docs.formats import PAGE, TABLE, refreshed

TEXT = PAGE.read_text("utf-8")


def test_the_tables_of_codes_are_the_programs():
    assert refreshed(TEXT) == TEXT, "run `make docs`"
    listed = [
        code for table in TABLE.finditer(TEXT) for code in re.findall(r"^\| `(W[A-Z-]+)`", table[3], re.M)
    ]
    assert sorted(listed) == sorted(CODES)
