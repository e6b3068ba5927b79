"""A fault: what stands where in a file, and what is put there instead."""

import random
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "dmc_cli"


@dataclass(frozen=True, order=True)
class Mutant:
    """`new` instead of the text from `start` to `end` of a file of the package, which `symbol` holds."""

    file: str
    start: int
    end: int
    new: str
    kind: str
    line: int
    old: str
    symbol: str

    def __str__(self):
        return f"{self.file}:{self.line} {self.kind}: {_short(self.old)} -> {_short(self.new) or '(nothing)'}"

    def put_into(self, source):
        """Return the text of the file with the fault."""
        return source[: self.start] + self.new + source[self.end :]


def _short(text):
    """Return a text on one line, cut where it is long."""
    words = " ".join(text.split())
    return words if len(words) <= 90 else words[:87] + "..."


CONSTANTS = "constant"
SHARE_OF_CONSTANTS = 0.25
"""Most that constants are of a sample: kernels are full of small numbers, and most of those faults crash."""


def sample(mutants, count, seed):
    """Up to `count` of the faults, no two at one place, the same ones for the same seed."""
    draws = random.Random(f"mutants {seed}")
    places = defaultdict(list)
    for mutant in sorted(mutants):
        places[mutant.file, mutant.start, mutant.end].append(mutant)
    drawn = [draws.choice(at_place) for _, at_place in sorted(places.items())]
    draws.shuffle(drawn)
    constants = [m for m in drawn if m.kind == CONSTANTS]
    others = [m for m in drawn if m.kind != CONSTANTS]
    kept = constants[: max(int(SHARE_OF_CONSTANTS * count), count - len(others))]
    return sorted([*kept, *others[: count - len(kept)]])
