"""`python -m tests.fuzz`: damage files for a set time, or a set number of times a reader.

What breaks a reader is kept in `tests/fuzz/crashers/`, where the tests read it ever after.
"""

import argparse
import collections
import hashlib
import random
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path

from tests.fuzz.honest import HONEST
from tests.fuzz.mutation import mutated
from tests.fuzz.trial import BrokenPromiseError, try_file

CRASHERS = Path(__file__).parent / "crashers"


def fuzz(reader, count, seconds, seed):
    """Number of files that broke the reader."""
    outcomes = collections.Counter()
    end = time.monotonic() + seconds
    draws = random.Random(f"{reader} {seed}")
    broken = 0
    with tempfile.TemporaryDirectory() as folder:
        paths = HONEST[reader](Path(folder))
        honest = [path.read_bytes() for path in paths]
        while sum(outcomes.values()) < count and time.monotonic() < end:
            path, content = draws.choice(list(zip(paths, honest, strict=True)))
            damaged = mutated(content, draws)
            path.write_bytes(damaged)
            try:
                outcomes[try_file(path, reader)] += 1
            except BrokenPromiseError as error:
                outcomes["BROKEN"] += 1
                broken += 1
                name = f"{reader}-{path.stem}-{hashlib.sha256(damaged).hexdigest()[:8]}{path.suffix}"
                (CRASHERS / name).write_bytes(damaged)
                print(f"{name}: {error}", file=sys.stderr)
                if broken <= 3:
                    traceback.print_exception(error)
            path.write_bytes(content)
    print(f"{reader}: {dict(outcomes.most_common())}")
    return broken


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60, help="time in all")
    parser.add_argument("--count", type=int, default=10**9, help="most files a reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("readers", nargs="*", default=sorted(HONEST))
    chosen = parser.parse_args()
    warnings.simplefilter("error")
    readers = chosen.readers or sorted(HONEST)
    return sum(fuzz(r, chosen.count, chosen.seconds / len(readers), chosen.seed) for r in readers) > 0


if __name__ == "__main__":
    sys.exit(main())
