"""Python runs no loop over nodes, cells, vertices or faces: many more of them take no more of its lines."""

import sys

import pytest

from dmc_cli.methods import METHODS, method_named
from tests.conftest import ROOT

PACKAGE = str(ROOT / "dmc_cli")


def lines_run(call):
    """How many lines of the package Python runs during a call, in this thread."""
    count = 0

    def trace(frame, event, argument):
        nonlocal count
        if not frame.f_code.co_filename.startswith(PACKAGE):
            return None
        count += event == "line"
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    finally:
        sys.settrace(before)
    return count


@pytest.mark.parametrize("method", METHODS)
def test_a_larger_volume_takes_no_more_lines(run, tmp_path, method):
    words = [
        "-i",
        0,
        "--method",
        method,
        "--report",
        tmp_path / "r.json",
        "--check",
        "--force",
        "--border",
        "closed",
    ]
    if method_named(method).faces == "quads":
        words += ["--simplify", "all"]

    def convert(nodes):
        volume = f"synth:genus_two:{nodes}"
        dump = ["--halfedges", tmp_path / "h.npz"]
        assert run("convert", volume, tmp_path / "a.ply", *words, *dump, "--quiet").exit_code == 0

    convert(16)  # kernels are loaded, modules imported
    few, many = (lines_run(lambda n=n: convert(n)) for n in (16, 40))
    print(method, few, many)
    assert many < 1.5 * few
