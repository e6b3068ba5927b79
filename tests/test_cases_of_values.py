"""Values near zero, far from it and beyond float32: the same two balls in all of them.

Counts and volumes are those of shared/cases/values_range/EXPECTED.txt.
"""

import json

import numpy as np
import pytest

from tests.cases import case


@pytest.fixture
def mesh_of(tmp_path, run):
    """Convert a case; return the section `mesh` of its report."""

    def call(name, isovalue, *words):
        report = tmp_path / "r.json"
        words = ["-i", repr(isovalue), "--spacing", "1,1,1", "--report", report, *words]
        result = run("convert", case(f"values_range/{name}.npy"), tmp_path / "a.ply", *words)
        assert result.exit_code == 0, result.stderr
        return json.loads(report.read_text())["mesh"]

    return call


@pytest.mark.parametrize("name", ["tiny_1e-13", "tiny_1e-40", "huge_1e40", "offset_1e9", "offset_1e12"])
def test_two_balls_at_any_size_of_value(mesh_of, name):
    values = np.load(case(f"values_range/{name}.npy"))
    found = mesh_of(name, float(values.min() + (values.max() - values.min()) / 2))
    assert (found["vertices"], found["volume"]) == (924, pytest.approx(1061.51, abs=0.01))


@pytest.mark.parametrize(
    ("name", "largest"), [("u64_ids", 9223372036854788153), ("i64_close", (1 << 60) + 1)]
)
def test_labels_that_no_double_tells_apart_are_one_box(mesh_of, name, largest):
    # the isovalue, a double, is rounded below both labels: all of the volume is inside
    assert mesh_of(name, largest, "--border", "closed")["volume"] == pytest.approx(23 * 27 * 31)
