"""Twins for a mesh that comes without a grid: halfedges paired by their vertices.

A pair of twins runs between the same two vertices in opposite directions. Where a vertex pair has more
halfedges than two, the mesh alone does not tell which belong together; then the first one that runs one
way is the twin of the first that runs the other way, the second of the second, in the order of their
numbers. What is left over, and a halfedge between a vertex and itself, stays without a twin.
"""

from typing import Any

import numpy as np

from dmc_cli.report.faces import NO_TWIN

IntArray = np.ndarray[Any, np.dtype[Any]]


def pair_halfedges(faces: IntArray) -> IntArray:
    """Return the twin of each halfedge, (4F,) int32, -1 where there is none.

    Args:
        faces: Corners, (F, 4) int32; a triangle has -1 as its fourth corner. Halfedge 4q + c runs from corner
            c of face q to the next one.
    """
    tails = faces.astype(np.int64)
    heads = np.roll(tails, -1, axis=1)
    is_triangle = tails[:, 3] < 0
    heads[is_triangle, 2] = tails[is_triangle, 0]
    tails, heads = tails.ravel(), heads.ravel()
    halfedges = np.flatnonzero((tails >= 0) & (tails != heads))
    tails, heads = tails[halfedges], heads[halfedges]
    pairs = np.minimum(tails, heads) << 32 | np.maximum(tails, heads)
    order = np.argsort(pairs)
    pairs, halfedges, is_up = pairs[order], halfedges[order], (tails < heads)[order]

    twins = np.full(faces.size, NO_TWIN, dtype=np.int32)
    bounds = np.flatnonzero(np.concatenate([[True], pairs[1:] != pairs[:-1], [True]]))
    sizes = np.diff(bounds)
    low = bounds[:-1][sizes == 2]
    low = low[is_up[low] != is_up[low + 1]]
    twins[halfedges[low]] = halfedges[low + 1]
    twins[halfedges[low + 1]] = halfedges[low]

    in_crowd = np.repeat(sizes > 2, sizes)
    if in_crowd.any():
        _pair_crowded(twins, pairs[in_crowd], halfedges[in_crowd], is_up[in_crowd])
    return twins


def _pair_crowded(twins: IntArray, pairs: IntArray, halfedges: IntArray, is_up: IntArray) -> None:
    """Pair the i-th halfedge up with the i-th down of each vertex pair, in the order of their numbers."""
    order = np.lexsort((halfedges, is_up, pairs))
    pairs, halfedges, is_up = pairs[order], halfedges[order], is_up[order]
    new_run = np.concatenate([[True], (pairs[1:] != pairs[:-1]) | (is_up[1:] != is_up[:-1])])
    run_start = np.maximum.accumulate(np.where(new_run, np.arange(pairs.shape[0]), 0))
    rank = np.arange(pairs.shape[0]) - run_start
    order = np.lexsort((is_up, rank, pairs))
    pairs, halfedges, is_up, rank = pairs[order], halfedges[order], is_up[order], rank[order]
    meets = (pairs[1:] == pairs[:-1]) & (rank[1:] == rank[:-1]) & ~is_up[:-1] & is_up[1:]
    low = np.flatnonzero(meets)
    twins[halfedges[low]] = halfedges[low + 1]
    twins[halfedges[low + 1]] = halfedges[low]
