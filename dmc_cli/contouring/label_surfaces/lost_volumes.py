"""Share out what quads without a regular corner sweep, which no vertex owes, over their labels' surfaces.

Such quads lie where junctions are everywhere, as in rough maps. What they sweep one label gains and another
loses. The interface of each two labels is to move by the same distance everywhere, so that every label has
its volume again; of all such distances those count whose squares, over the areas, have the least sum. They
are differences of one number a label, which a system of equations gives, the Laplacian of the graph of labels
weighted by the areas of their interfaces. The background's number is 0.
"""

import numpy as np

from dmc_cli.array_types import Float64Array, Int32Array, IntArray

MOST_ROUNDS = 200
"""Rounds of solving, at most."""

ACCURACY = 1e-9
"""Share of the lack that may be left by the solution."""


def shared_out(
    lost: Float64Array, sides: Int32Array, vertex_sides: Int32Array, areas: Float64Array
) -> Float64Array:
    """Return what each vertex owes of what quads have swept, float64 (V,).

    Args:
        lost: What each quad swept from the first of its sides to the second, float64 (Q,).
        sides: Codes of the labels on its sides, int32 (Q, 2).
        vertex_sides: Those on the sides of each vertex, int32 (V, 2).
        areas: Its area, 0 where it owes nothing, float64 (V,).
    """
    count = int(sides.max(initial=0)) + 1
    gained = _balance(sides.T, lost, count)
    keys, places = np.unique(
        vertex_sides[:, 0].astype(np.int64) * count + vertex_sides[:, 1], return_inverse=True
    )
    pairs = np.stack([keys // count, keys % count])
    shares: Float64Array = np.bincount(places, areas, len(keys)).astype(np.float64)
    numbers = _solved(pairs, shares, gained)
    moves: Float64Array = (numbers[pairs[0]] - numbers[pairs[1]])[places] * areas
    return moves


def _balance(pairs: IntArray, amounts: Float64Array, count: int) -> Float64Array:
    """Return what each label has of amounts that the first of a pair gains and the second loses."""
    found = np.bincount(pairs[0], amounts, count) - np.bincount(pairs[1], amounts, count)
    return found.astype(np.float64)


def _solved(pairs: IntArray, weights: Float64Array, wanted: Float64Array) -> Float64Array:
    """Return the number of each label, 0 of the background, by conjugate gradients; float64 (n,)."""
    count = len(wanted)
    diagonal = np.bincount(pairs[0], weights, count) + np.bincount(pairs[1], weights, count)
    is_free = diagonal > 0
    is_free[0] = False

    def applied(x: Float64Array) -> Float64Array:
        flow = weights * (x[pairs[0]] - x[pairs[1]])
        return np.where(is_free, _balance(pairs, flow, count), 0.0)

    solution, lack = np.zeros(count), np.where(is_free, wanted, 0.0)
    scaled = np.where(is_free, lack / np.maximum(diagonal, 1e-300), 0.0)
    way, size = scaled.copy(), float(lack @ scaled)
    least = ACCURACY**2 * size
    for _ in range(MOST_ROUNDS):
        if size <= least:
            break
        image = applied(way)
        step = size / float(way @ image) if float(way @ image) > 0 else 0.0
        solution += step * way
        lack -= step * image
        scaled = np.where(is_free, lack / np.maximum(diagonal, 1e-300), 0.0)
        before, size = size, float(lack @ scaled)
        way = scaled + size / before * way
    return solution
