"""Order the triangles of faces so that readers can put them together again: FB_ngon_encoding of glTF.

All triangles of a face follow each other and begin with the same vertex; faces that follow each other begin
with different ones.
"""

import numpy as np

from dmc_cli.array_types import AnyArray, Int32Array
from dmc_cli.mesh_io.mesh_file import NO_CORNER


def apart(fans: Int32Array, last: int) -> Int32Array:
    """Return faces turned so that none begins with the vertex that the one before begins with.

    A quad may begin at either end of its diagonal, a triangle at its first or second corner. The first is
    taken unless the face before begins there, which depends on where that one begins, and so on. So each face
    either asks nothing of the one before, or begins at the same one of its two, or at the other one: where it
    begins is the parity of the changes since the last face that asks nothing.

    Args:
        fans: Faces, (n, 4), each from the corner on that its diagonal starts from.
        last: The vertex that the face before the first begins with, -1 without one.
    """
    is_quad = fans[:, 3] != NO_CORNER
    first, second = fans[:, 0], np.where(is_quad, fans[:, 2], fans[:, 1])
    first_before = np.concatenate([[last], first[:-1]])
    second_before = np.concatenate([[-2], second[:-1]])
    is_same, is_other = second_before == first, first_before == first
    changes = np.cumsum(is_other)
    free = np.where(is_same | is_other, -1, np.arange(len(fans)))
    latest = np.maximum.accumulate(free)
    begins_second = (changes - np.where(latest < 0, 0, changes[latest])) % 2 == 1
    turned = np.where(is_quad[:, None], fans[:, [2, 3, 0, 1]], fans[:, [1, 2, 0, 3]])
    chosen: Int32Array = np.where(begins_second[:, None], turned, fans)
    return chosen


def put_together(triangles: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Return the number of corners of each face, and the corners of all in a row.

    Args:
        triangles: Vertices, (n, 3), in the order that `apart` makes.
    """
    begins = np.ones(len(triangles), bool)
    begins[1:] = triangles[1:, 0] != triangles[:-1, 0]
    starts = np.flatnonzero(begins)
    counts = np.diff(np.append(starts, len(triangles))) + 2
    corners = np.empty(counts.sum(), triangles.dtype)
    ends = np.cumsum(counts)
    corners[ends - counts] = triangles[starts, 0]
    corners[ends - counts + 1] = triangles[starts, 1]
    rest = np.ones(len(corners), bool)
    rest[np.concatenate([ends - counts, ends - counts + 1])] = False
    corners[rest] = triangles[:, 2]
    return counts, corners


def can_be_told(faces: Int32Array) -> bool:
    """Return whether each face has two corners to begin at: no corner that it may begin at stands twice."""
    is_quad = faces[:, 3] != NO_CORNER
    is_twice = np.where(
        is_quad, (faces[:, 0] == faces[:, 2]) | (faces[:, 1] == faces[:, 3]), faces[:, 0] == faces[:, 1]
    )
    return not bool(is_twice.any())
