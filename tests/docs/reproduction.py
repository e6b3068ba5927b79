"""The tables of docs/reproduction.md, from what `dmc reproduce` has found.

`python -m tests.docs.reproduction FOUND.json` keeps what `dmc reproduce --json` wrote in
tests/data/reproduced.csv, times left out, and writes the tables anew; without a file it writes only these.
"""

import csv
import json
import re
import sys
from collections import Counter
from pathlib import Path

from dmc_cli.reproduction.paper_tables import PAPER_VALUES
from dmc_cli.reproduction.reproduce import Row, figures

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "reproduction.md"
FOUND = ROOT / "tests" / "data" / "reproduced.csv"
PART = re.compile(r"(<!-- (summary|table (\w)) -->\n)(.*?)(?=<!-- end -->)", re.DOTALL)
BAR = r"\|"
COLUMNS = ("table", "data", "mesh", "quantity", "found")


def keep(path):
    """Write what a run has found as a table of seven digits, times left out."""
    rows = json.loads(Path(path).read_text("utf-8"))
    with FOUND.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows:
            if row["expected"] != "machine" and row["found"] is not None:
                writer.writerow([*(str(row[key]) for key in COLUMNS[:-1]), kept_text(row["found"])])


def kept_text(found):
    """A figure as it is kept: a whole number as it is, others with seven digits."""
    return f"{found:.0f}" if float(found).is_integer() else f"{found:.7g}"


def found_rows():
    """The rows of the papers with what was found, times left out."""
    with FOUND.open(encoding="utf-8") as file:
        kept = {tuple(row[key] for key in COLUMNS[:-1]): float(row["found"]) for row in csv.DictReader(file)}
    return [
        Row(value=value, found=kept.get((str(value.table), value.data.name, value.mesh, value.quantity)))
        for value in PAPER_VALUES
        if value.expectation != "machine"
    ]


def refreshed(text):
    """The page with its tables as they are now."""
    rows = found_rows()
    return PART.sub(lambda match: match[1] + (table_of(rows, match[3]) if match[3] else summary(rows)), text)


def table_of(rows, table):
    """A table of the papers in Markdown."""
    lines = [
        "| data | mesh | quantity | printed | found | reason |",
        "| --- | --- | --- | ---: | ---: | --- |",
    ]
    for row in rows:
        value = row.value
        if str(value.table) == table:
            printed, found, _ = figures(row)
            reason = "no scan" if row.found is None else row.reason
            cells = (value.data.name, value.mesh, value.quantity, printed, found, reason)
            lines.append(f"| {' | '.join(cell.replace('|', BAR) for cell in cells)} |")
    return "\n".join(lines) + "\n"


def summary(rows):
    """How many figures are as printed, and how many are not, by why."""
    ours = [row for row in rows if row.value.expectation != "other_data"]
    others = [row for row in rows if row.value.expectation == "other_data"]
    kinds = Counter("same" if row.agrees else row.value.expectation for row in ours)
    made = sum(row.found is not None for row in others)
    off = max(abs(row.difference) for row in ours if row.value.expectation == "close" and not row.agrees)
    same, close, misprints = (kinds[kind] for kind in ("same", "close", "misprint"))
    lines = (
        f"Of {len(ours)} figures of 2021, {same} are found as they are printed, to their last digit;",
        f"{close} differ by {off:.2f} at most, where rounding decides; {misprints} cannot be right",
        f"as they are printed. Of {len(others)} figures of 2009, {made} have a scan to be held",
        "against, of another copy.",
    )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if sys.argv[1:]:
        keep(sys.argv[1])
    PAGE.write_text(refreshed(PAGE.read_text("utf-8")), "utf-8")
