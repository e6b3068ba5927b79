"""Find where a mesh intersects itself: pairs of faces that have more in common than they should.

The surface of a quad is that of its two triangles, split by the MaxMin-angle criterion as area and volume
are. Two faces intersect if a triangle of one and a triangle of the other have a point in common that is not
on a corner or side that both triangles have; touching counts. A corner is the same where its position is, so
it does not matter whether a file names a vertex once or several times. Triangles without an area count for
nothing, and a quad whose own triangles overlap is no pair.

Which faces may meet is found by a tree of boxes; most neighbours are told apart by a line between them, seen
along an axis, with the rounding error taken into account; the rest is decided exactly (`predicates.py`).
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Int32Array
from dmc_cli.bits import bit_index, low_bits
from dmc_cli.measures.predicates import are_apart, triangles_meet
from dmc_cli.measures.split_faces import QuadPoints, face_points, split_faces
from dmc_cli.mesh import CHILDREN, Levels, Masks, Mesh, boxes_meeting, build_tree, child_count, require_mesh
from dmc_cli.runtime import mesh_size

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

BLOCKS_A_CHUNK = 4
MOST_BLOCKS_A_CHUNK = 256
"""Blocks of eight faces a chunk, at least and at most: a block takes some fifty microseconds."""


@wp.func
def faces_meet(p: QuadPoints, q: QuadPoints) -> wp.bool:
    """Return whether two faces intersect."""
    if are_apart(p, q) or are_apart(q, p):
        return False
    if triangles_meet(p[0], p[1], p[2], q[0], q[1], q[2]):
        return True
    if triangles_meet(p[0], p[1], p[2], q[0], q[2], q[3]):
        return True
    if triangles_meet(p[0], p[2], p[3], q[0], q[1], q[2]):
        return True
    return triangles_meet(p[0], p[2], p[3], q[0], q[2], q[3])


@wp.func
def meet_blocks(
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    order: wp.array[wp.int32],
    lows: wp.array[wp.vec3f],
    highs: wp.array[wp.vec3f],
    block: wp.int32,
    other: wp.int32,
    slot: wp.int64,
    pairs_out: wp.array[wp.vec2i],
) -> wp.int64:
    """Count the pairs of two blocks' faces that intersect, and list them from `slot` on if there is room."""
    count = wp.int64(0)
    start = CHILDREN * other
    size = wp.min(CHILDREN, order.shape[0] - start)
    for a in range(CHILDREN * block, wp.min(CHILDREN * (block + 1), order.shape[0])):
        left = boxes_meeting(lows, highs, start, size, a)
        if other == block:
            left &= ~low_bits(a - start + 1)
        if left != wp.uint32(0):
            f = order[a]
            face = face_points(points, corners, turns, f)
            while left != wp.uint32(0):
                g = order[start + bit_index(left)]
                left &= left - wp.uint32(1)
                if faces_meet(face, face_points(points, corners, turns, g)):
                    if pairs_out.shape[0] > 0:
                        pairs_out[slot + count] = wp.vec2i(wp.min(f, g), wp.max(f, g))
                    count += wp.int64(1)
    return count


@wp.kernel
def intersect_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    order: wp.array[wp.int32],
    lows: wp.array[wp.vec3f],
    highs: wp.array[wp.vec3f],
    levels: Levels,
    top: wp.int32,
    starts: wp.array[wp.int64],
    # Out:
    counts_out: wp.array[wp.int64],
    pairs_out: wp.array[wp.vec2i],
) -> None:
    """Count, or with `starts` list, the intersections of a block's faces with those at and after it.

    One thread per block of eight faces.
    """
    block = first + wp.tid()
    slot = wp.int64(0)
    if pairs_out.shape[0] > 0:
        slot = starts[block]
        if slot == starts[block + 1]:
            return
    box = levels[1] + block
    count = meet_blocks(points, corners, turns, order, lows, highs, block, block, slot, pairs_out)
    lefts = Masks()
    bases = Levels()
    n = int(block)
    for above in range(1, top):
        start = n & ~(CHILDREN - 1)
        size = child_count(levels, above, n / CHILDREN)
        meeting = boxes_meeting(lows, highs, levels[above] + start, size, box)
        bases[above] = start
        lefts[above] = meeting & ~low_bits(n - start + 1)
        n = n / CHILDREN
    level = int(1)
    while level < top:
        left = lefts[level]
        if left == wp.uint32(0):
            level += 1
        else:
            n = bases[level] + bit_index(left)
            lefts[level] = left & (left - wp.uint32(1))
            if level > 1:
                level -= 1
                start = CHILDREN * n
                bases[level] = start
                size = child_count(levels, level, n)
                lefts[level] = boxes_meeting(lows, highs, levels[level] + start, size, box)
            else:
                count += meet_blocks(
                    points, corners, turns, order, lows, highs, block, n, slot + count, pairs_out
                )
    if pairs_out.shape[0] == 0:
        counts_out[block] = count


@wp.kernel
def intersect_some_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    order: wp.array[wp.int32],
    lows: wp.array[wp.vec3f],
    highs: wp.array[wp.vec3f],
    levels: Levels,
    top: wp.int32,
    places: wp.array[wp.int32],
    starts: wp.array[wp.int64],
    # Out:
    counts_out: wp.array[wp.int64],
    pairs_out: wp.array[wp.vec2i],
) -> None:
    """Count, or with `starts` list, the intersections of a face with all others.

    One thread per face, given by its place in the order.
    """
    item = first + wp.tid()
    place = places[item]
    f = order[place]
    face = face_points(points, corners, turns, f)
    count = wp.int64(0)
    lefts = Masks()
    bases = Levels()
    level = int(top)
    lefts[top] = wp.uint32(1)
    while level <= top:
        left = lefts[level]
        if left == wp.uint32(0):
            level += 1
        else:
            n = bases[level] + bit_index(left)
            lefts[level] = left & (left - wp.uint32(1))
            if level > 0:
                level -= 1
                start = CHILDREN * n
                bases[level] = start
                size = child_count(levels, level, n)
                lefts[level] = boxes_meeting(lows, highs, levels[level] + start, size, place)
            elif n != place:
                g = order[n]
                if faces_meet(face, face_points(points, corners, turns, g)):
                    if pairs_out.shape[0] > 0:
                        pairs_out[starts[item] + count] = wp.vec2i(wp.min(f, g), wp.max(f, g))
                    count += wp.int64(1)
    if pairs_out.shape[0] == 0:
        counts_out[item] = count


def count_intersections(mesh: Mesh) -> int:
    """Count the pairs of faces of a mesh that intersect.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    if require_mesh(mesh).face_count < 2:
        return 0
    return mesh.device.total(_Search(mesh).count())


def find_intersections(mesh: Mesh, faces: Int32Array | None = None) -> Int32Array:
    """Return the pairs of faces of a mesh that intersect, (n, 2) int32, lower face first, ascending.

    Args:
        mesh: The mesh.
        faces: Only pairs with one of these faces are looked for; without them all are.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
        DeviceError: There are more pairs than 32 bits can number.
    """
    if require_mesh(mesh).face_count < 2 or (faces is not None and not len(faces)):
        return np.empty((0, 2), np.int32)
    search = _Search(mesh, faces)
    counts = search.count()
    found = search.list_pairs(counts, mesh_size(mesh.device.total(counts)))
    pairs: Int32Array = np.unique(found, axis=0).reshape(-1, 2)
    return pairs


class _Search:
    """A mesh with what is looked up to find its intersections: the tree, and how quads are split.

    Pairs of given faces are looked for face by face, so one of two given faces is found twice.
    """

    def __init__(self, mesh: Mesh, faces: Int32Array | None = None) -> None:
        self.mesh, self.device, self.tree = mesh, mesh.device, build_tree(mesh)
        self.turns = split_faces(mesh)
        self.places: Any = None
        self.size = self.tree.level_size(1)
        if faces is not None:
            is_given = np.zeros(mesh.face_count, bool)
            is_given[faces] = True
            places = np.flatnonzero(is_given[self.tree.order.numpy()]).astype(np.int32)
            self.places, self.size = wp.array(places, dtype=wp.int32, device=self.device.name), len(places)

    def count(self) -> Any:
        """Return the pairs of each block of faces with those at and after it, or of each face, int64."""
        counts = self.device.empty(self.size, wp.int64)
        self._launch(self.device.empty(0, wp.int64), [counts, self.device.empty(0, wp.vec2i)])
        return counts

    def list_pairs(self, counts: Any, total: int) -> Any:
        """Return the pairs that were counted, (total, 2) int32."""
        pairs = self.device.empty(total, wp.vec2i)
        if total:
            self._launch(self.device.starts(counts)[0], [counts, pairs])
        return pairs.numpy().reshape(-1, 2)

    def _launch(self, starts: Any, outputs: list[Any]) -> None:
        mesh, tree = self.mesh, self.tree
        inputs = [mesh.positions, mesh.corners, self.turns]
        inputs += [tree.order, tree.lows, tree.highs, tree.starts, tree.top]
        if self.places is None:
            inputs += [starts]
            grains = (BLOCKS_A_CHUNK, MOST_BLOCKS_A_CHUNK)
            self.device.launch(intersect_kernel, self.size, inputs, outputs, *grains)
        else:
            self.device.launch(intersect_some_kernel, self.size, [*inputs, self.places, starts], outputs)
