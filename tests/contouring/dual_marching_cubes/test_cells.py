"""Special cells are found in rows of one word and of several, and their vertices come last."""

import numpy as np
import pytest

from tests.fields import volume_of

FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (2, 3, 6, 7), (0, 2, 4, 6), (1, 3, 5, 7)]
"""Corners of the faces of a cell, the first and the last on a diagonal."""


def may_have_several_polygons(case: int) -> bool:
    """Whether a face is ambiguous, or two opposite corners are alone."""
    bits = [case >> c & 1 for c in range(8)]
    ambiguous = any(bits[a] == bits[d] != bits[b] == bits[c] for a, b, c, d in FACES)
    return ambiguous or any(case in (1 << c | 1 << 7 - c, 255 ^ (1 << c | 1 << 7 - c)) for c in range(8))


SEVERAL = np.array([may_have_several_polygons(case) for case in range(256)])


def corners(nodes):
    """The eight corners of each cell, [8, k, j, i]."""
    ends = (slice(None, -1), slice(1, None))
    return np.stack([nodes[ends[c >> 2], ends[c >> 1 & 1], ends[c & 1]] for c in range(8)])


def cells_of(values, border):
    """Which cells are active, and which of them are special, [k, j, i]."""
    if border == "closed":
        values = np.pad(np.nan_to_num(values, nan=-1.0), 1, constant_values=-1.0)
    data = np.isfinite(values)
    inside = corners(values >= 0)
    active = inside.any(axis=0) & ~inside.all(axis=0) & corners(data).all(axis=0)
    near = np.pad(data, 1, constant_values=border == "closed")
    whole = np.lib.stride_tricks.sliding_window_view(near, (4, 4, 4)).all(axis=(3, 4, 5))
    case = (inside * (1 << np.arange(8))[:, None, None, None]).sum(axis=0)
    return active, active & (SEVERAL[case] | ~whole)


def crossed_edges(values, border):
    """How many edges have both ends with data, on different sides."""
    if border == "closed":
        values = np.pad(np.nan_to_num(values, nan=-1.0), 1, constant_values=-1.0)
    found = 0
    for axis in range(3):
        low, high = (np.delete(values, place, axis) for place in (-1, 0))
        found += (np.isfinite(low + high) & ((low >= 0) != (high >= 0))).sum()
    return found


@pytest.mark.parametrize("missing", [0.0, 0.02])
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("nx", [2, 31, 32, 33, 34, 63, 64, 65, 97])
def test_cells_of_several_polygons_and_those_that_lack_quads_are_special(extract, nx, border, missing):
    rng = np.random.default_rng(nx)
    i, j, k = np.ogrid[:nx, :7, :6]
    wave = np.sin(0.7 * i + 0.3) + np.cos(1.1 * j) + np.sin(0.9 * k)
    values = (wave + 0.7 * rng.standard_normal((nx, 7, 6))).T.astype(np.float32)
    values[rng.random(values.shape) < missing] = np.nan
    surface = extract(volume_of(values), border=border)
    active, special = cells_of(values, border)
    rows, row_cells = surface.numbering.cells.special_row.numpy(), surface.numbering.cells.special_i.numpy()
    k, j, i = np.nonzero(special)
    np.testing.assert_array_equal(rows, j + k * surface.placement.frame.grid.ny)
    np.testing.assert_array_equal(row_cells, i)
    assert surface.counts.crossed_edges == crossed_edges(values, border)
    assert surface.numbering.cells.ordinary_count == (active & ~special).sum() > 0 or nx == 2


def test_cells_of_every_case(extract):
    """A cell of each case, with outside nodes round it."""
    values = np.full((4, 3 * 16 + 1, 3 * 16 + 1), -1.0, np.float32)
    for case in range(256):
        j, i = 1 + 3 * (case // 16), 1 + 3 * (case % 16)
        values[1:3, j : j + 2, i : i + 2] = np.where([case >> c & 1 for c in range(8)], 1.0, -1.0).reshape(
            2, 2, 2
        )
    cells = extract(volume_of(values), border="closed").numbering.cells
    _, special = cells_of(values, "closed")
    np.testing.assert_array_equal(cells.special_i.numpy(), np.nonzero(special)[2])
