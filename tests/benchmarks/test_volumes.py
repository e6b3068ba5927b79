"""What the table of all volumes says of its columns is what is in them."""

import importlib

import pytest

from tests.conftest import ROOT


@pytest.fixture
def volumes(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("volumes")


def row(volumes, volume, method, **known):
    values = dict.fromkeys((key for _, key, _ in volumes.COLUMNS), 1)
    return {"volume": volume, "isovalue": 5.0, "method": method, **values, **known}


@pytest.fixture
def rows(volumes):
    return [
        row(
            volumes, "a", "dmc", time_ratio=1.5, shape_mean=0.9, deviation_mean_mm=1e-8, closed_difference=-2
        ),
        row(volumes, "a", "mc", time_ratio=1.0, shape_mean=None, deviation_mean_mm=3e-9, closed_difference=1),
        row(volumes, "b", "dmc", time_ratio=1.0, shape_mean=0.9, deviation_mean_mm=1e-8, closed_difference=0),
        row(volumes, "b", "mc", time_ratio=2.0, shape_mean=None, deviation_mean_mm=0.5, closed_difference=0),
    ]


def test_the_best_are_counted_surface_by_surface(volumes, rows):
    wins = volumes.wins_of(rows)
    assert wins["time of extraction"] == {"dmc": 1, "mc": 1}
    assert wins["mean shape of quads (equation 9)"] == {"dmc": 2, "mc": 0}
    assert wins["mean distance from the surface"] == {"dmc": 2, "mc": 1}
    assert wins["Euler characteristic of the trilinear surface, closed"] == {"dmc": 1, "mc": 2}


def test_where_ours_is_not_the_best_is_said_in_words(volumes, rows):
    text = volumes.report_of(rows, ["c: not there"])
    trilinear = "Euler characteristic of the trilinear surface, closed"
    assert f"- {trilinear}: dmc is the best on 1 of 2; mc on 2." in text
    assert "- time of extraction: dmc is the best on 1 of 2, no other on more." in text
    assert "- mean shape of quads" not in text
    assert "On all 2 it is the best, alone or with others, by: memory, mean distance" in text
    assert "| a, 5 | mc | 1 | 1 | 1.00 |" in text
    assert text.endswith("- c: not there")


def test_every_volume_stands_once_with_isovalues(volumes):
    names = [scan.name for scan in volumes.SCANS]
    assert len(set(names)) == len(names) > 30
    assert all(scan.isovalues for scan in volumes.SCANS)
