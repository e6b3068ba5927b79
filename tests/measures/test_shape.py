"""Turns: angles without arc tangents."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.measures.shape import quotient, turn_angle, turn_between


@pytest.fixture(params=["python", "compiled"])
def evaluate(request):
    """Call a wp.func of doubles on columns of arguments: by Python, then compiled by Warp."""

    def run(func, *columns):
        if request.param == "python":
            rows = zip(*(c.tolist() for c in columns), strict=True)
            return np.array([float(func(*map(wp.float64, row))) for row in rows])
        return wp.map(func, *(wp.array(c, dtype=wp.float64, device="cpu") for c in columns)).numpy()

    return run


ANGLES = np.concatenate([[0.0, 1e-9], np.linspace(1e-3, np.pi - 1e-3, 101), [np.pi - 1e-9, np.pi]])


def test_a_turn_gives_its_angle_back(evaluate):
    turns = evaluate(turn_between, 3 * np.cos(ANGLES), 3 * np.abs(np.sin(ANGLES)))
    assert evaluate(turn_angle, turns) == pytest.approx(ANGLES, abs=1e-14)


def test_a_turn_grows_with_its_angle(evaluate):
    turns = evaluate(turn_between, np.cos(ANGLES), np.abs(np.sin(ANGLES)))
    assert (np.diff(turns) > 0).all()
    assert (turns[0], turns[-1]) == (0.0, pytest.approx(2.0, abs=1e-15))


def test_turns_over_2_are_reflex_angles(evaluate):
    turns = np.array([2.0, 3.0, 4.0])
    assert evaluate(turn_angle, turns) == pytest.approx([np.pi, 1.5 * np.pi, 2 * np.pi])


def test_nothing_over_nothing_is_0(evaluate):
    assert evaluate(quotient, np.array([1.0, 0.0, 3.0]), np.array([0.0, 0.0, 2.0])).tolist() == [
        0.0,
        0.0,
        1.5,
    ]
