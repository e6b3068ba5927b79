"""The reference counts of the papers' fields, as tables of strings."""

import csv
from pathlib import Path

DATA = Path(__file__).parent / "data"


def table(name: str) -> list[dict[str, str]]:
    """The rows of a table of reference counts, comments left out."""
    lines = (DATA / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def rows_of_size(*sizes: int) -> list[dict[str, str]]:
    """The rows of the synthetic fields at the given numbers of nodes an axis."""
    return [row for row in table("regression_counts.csv") if int(row["n"]) in sizes]
