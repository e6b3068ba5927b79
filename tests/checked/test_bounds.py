"""An access beside an array ends the process where `--checked` asks for it, and nothing else does."""

import os
import subprocess
import sys

import pytest

from tests.conftest import ROOT

TOLD = {
    "item": "read_item_0: items {0} to {0} of items, which has 4",
    "run": "read_run_0: items {1} to {0} of items, which has 4",
    "row": "write_row_0: items {0} to {0} of rows, which has 4",
    "list": "",  # an instruction that no processor has
    "warp": "Assertion failed: 'i >= -arr.shape[0] && i < arr.shape[0]'",
}
"""What is told of an access, by its way and item."""


@pytest.fixture(scope="session")
def reach(tmp_path_factory):
    cache = {"WARP_CACHE_PATH": str(tmp_path_factory.mktemp("checked"))}

    def run(way, item):
        words = [sys.executable, "-m", "tests.checked.broken", way, str(item)]
        environment = os.environ | cache
        return subprocess.run(
            words, cwd=ROOT, env=environment, capture_output=True, encoding="utf-8", check=False, timeout=100
        )

    return run


@pytest.mark.slow
@pytest.mark.parametrize("way", TOLD)
def test_an_access_beside_an_array_ends_the_process(way, reach):
    inside = reach(way, 3)
    assert inside.stdout.endswith("done\n"), inside.stderr
    beside = reach(way, 4)
    assert beside.returncode < 0
    assert "done" not in beside.stdout
    assert TOLD[way].format(4, 3) in beside.stdout + beside.stderr
