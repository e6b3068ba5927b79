"""What preparing a part of a volume is said to take, beside what it takes: at most a fifth off."""

import numpy as np
import pytest

from tests.memory.test_forecast import MOST, measure
from tests.memory.volumes import iwp

__all__ = ["measure"]

PARTS = {
    "crop": ["--crop", "10%:90%,:,:"],
    "keep": ["--keep", "largest"],
    "least volume": ["--min-volume", "100"],
    "cavities": ["--fill-cavities", "all"],
    "table": ["--cut-table"],
    "opened": ["--open-gaps", "2"],
    "closed": ["--close-gaps", "2"],
    "coarser": ["--resample", "2"],
    "finer": ["--resample", "0.8"],
    "smoothed": ["--smooth-volume", "1"],
    "band": ["--isovalue", "band:-1000:1000"],
    "several": ["--smooth-volume", "1", "--keep", "largest", "--fill-cavities", "all"],
}
FEW = ("keep", "smoothed")
"""Parts that the quick run looks at."""


def told_and_taken(measure, words, folder, count):
    """Return the largest forecast of the preparation and its peak, in MiB."""
    path = folder / "field.npy"
    if not path.exists():
        noise = np.random.default_rng(5).standard_normal((count,) * 3, np.float32)
        np.save(path, (3000 * iwp((count,) * 3) + 3000 * noise).astype(np.int16))
    level = [] if "--isovalue" in words else ["-i", "4000"]
    peaks = measure(["convert", path, folder / "mesh.ply", *level, *words, "--dry-run", "--quiet"])
    told = [forecast["prepare"] for forecast in peaks.forecasts if "prepare" in forecast]
    return max(told) / 2**20, peaks.stages["prepare"] / 2**20


@pytest.mark.parametrize("name", FEW)
def test_a_few_forecasts_of_preparation_are_near_the_peak(name, measure, tmp_path):
    told, taken = told_and_taken(measure, PARTS[name], tmp_path, 200)
    assert 1 / MOST <= told / taken <= MOST


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", PARTS)
def test_the_forecast_of_preparation_is_near_the_peak(name, measure, tmp_path):
    told, taken = told_and_taken(measure, PARTS[name], tmp_path, 360)
    assert 1 / MOST <= told / taken <= MOST, f"{told:.0f} MiB told, {taken:.0f} taken"
