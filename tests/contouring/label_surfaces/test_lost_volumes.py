"""What no vertex owes is shared out so that every label has its volume again, by the least moves."""

import numpy as np
import pytest

from dmc_cli.contouring.label_surfaces.lost_volumes import shared_out

SIDES = np.array([[1, 0], [2, 0], [2, 1], [3, 2], [3, 1], [4, 3]], np.int32)
"""Interfaces of four labels; the last one meets the background nowhere."""


def moved(owed, vertex_sides, count=5):
    """What each label gives back where vertices do."""
    return np.bincount(vertex_sides[:, 0], owed, count) - np.bincount(vertex_sides[:, 1], owed, count)


def test_each_label_gives_back_what_it_has_gained_by_the_least_moves():
    rng = np.random.default_rng(0)
    vertex_sides, areas = SIDES[rng.integers(0, 6, 300)], rng.random(300)
    sides, lost = SIDES[rng.integers(0, 6, 40)], rng.normal(size=40)
    owed = shared_out(lost, sides, vertex_sides, areas)
    gained = np.bincount(sides[:, 0], lost, 5) - np.bincount(sides[:, 1], lost, 5)
    np.testing.assert_allclose(moved(owed, vertex_sides)[1:], gained[1:], atol=1e-7)
    # of all distances that do so, a row of equations a label, those of least squares over the areas
    of_pair = [(vertex_sides == pair).all(axis=1) for pair in SIDES]
    weights = np.array([areas[own].sum() for own in of_pair])
    rows = np.array([(SIDES[:, 0] == n).astype(float) - (SIDES[:, 1] == n) for n in range(1, 5)])
    scaled, *_ = np.linalg.lstsq(rows * np.sqrt(weights), gained[1:], rcond=None)
    found = [owed[own].sum() / areas[own].sum() for own in of_pair]
    np.testing.assert_allclose(found, scaled / np.sqrt(weights), atol=1e-7)


@pytest.mark.parametrize("areas", [np.zeros(1), np.zeros(0)])
def test_where_there_is_no_area_nothing_is_owed(areas):
    vertex_sides = np.array([[2, 1]] * len(areas), np.int32).reshape(-1, 2)
    owed = shared_out(np.ones(1), np.array([[2, 1]], np.int32), vertex_sides, areas)
    assert owed.tolist() == [0.0] * len(areas)
