"""The generated part of docs/formats.md: the tables of warnings' codes.

`make docs` writes them anew (python -m tests.docs.formats); a test fails where they are stale.
"""

import re

from dmc_cli import notices
from tests.docs.readme import ROOT

PAGE = ROOT / "docs" / "formats.md"
TABLE = re.compile(r"(<!-- codes (\w+) -->\n)(.*?)(?=<!-- end -->)", re.DOTALL)


def refreshed(text):
    """Return the page with its tables as the program has them."""
    return TABLE.sub(lambda match: match[1] + code_table(getattr(notices, match[2])), text)


def code_table(codes):
    """Return codes and what they mean as a Markdown table."""
    lines = ["| code | what it means |", "| --- | --- |"]
    return "\n".join([*lines, *(f"| `{code}` | {meaning} |" for code, meaning in codes.items())]) + "\n"


if __name__ == "__main__":
    PAGE.write_text(refreshed(PAGE.read_text("utf-8")), "utf-8")
