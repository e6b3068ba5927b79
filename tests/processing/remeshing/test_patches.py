"""Quads measured side by side are, bit by bit, as measured one by one; patches, folds and rings are right."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.processing.quad_square import quad_area, quad_shape, warp_cosine
from dmc_cli.processing.remeshing.checks import is_ring_sound
from dmc_cli.processing.remeshing.patches import (
    MEASURES,
    RISE,
    SHAPE,
    WARP_COSINE,
    add_ring_to_patch,
    add_to_patch,
    count_folded_sides,
    measure_quads,
)
from dmc_cli.processing.remeshing.work import PATCH
from tests.mesh.hand_made import working
from tests.shapes import corner_to_corner_cubes, cube, sphere, torus

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

REGION, REGIONS = 1, 3


@wp.kernel
def measure_kernel(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    measured: wp.array3d(dtype=wp.float32),
):
    measure_quads(corners, position, normal, patch, b, count, measured)


@wp.kernel
def scalar_kernel(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    told: wp.array2d(dtype=wp.float32),
):
    n = wp.tid()
    q = patch[b, n]
    i = corners[4 * q]
    j = corners[4 * q + 1]
    k = corners[4 * q + 2]
    m = corners[4 * q + 3]
    told[SHAPE, n] = quad_shape(position[i], position[j], position[k], position[m])
    told[WARP_COSINE, n] = warp_cosine(position[i], position[j], position[k], position[m])
    up = (normal[i] + normal[j]) + (normal[k] + normal[m])
    told[RISE, n] = wp.dot(quad_area(corners, position, q), up)


@wp.kernel
def fold_kernel(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    vertex_region: wp.array(dtype=wp.int32),
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    told: wp.array(dtype=wp.int32),
):
    told[0] = count_folded_sides(corners, twin, position, vertex_region, patch, b, count)


@wp.kernel
def add_kernel(
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    quads: wp.array(dtype=wp.int32),
    told: wp.array(dtype=wp.int32),
):
    count = int(0)  # noqa: UP018, RUF046
    for n in range(quads.shape[0]):
        told[n] = add_to_patch(patch, b, count, quads[n])
        count = wp.min(told[n], PATCH)


@wp.kernel
def add_ring_kernel(
    twin: wp.array(dtype=wp.int32),
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    starts: wp.array(dtype=wp.int32),
    sizes: wp.array(dtype=wp.int32),
    told: wp.array(dtype=wp.int32),
):
    size = wp.int32(count)
    for n in range(starts.shape[0]):
        told[n] = add_ring_to_patch(twin, patch, b, size, starts[n], sizes[n])
        size = wp.min(told[n], PATCH)


@wp.kernel
def sound_kernel(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    v: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    size: wp.array(dtype=wp.int32),
    told: wp.array(dtype=wp.int32),
):
    n = wp.tid()
    told[n] = wp.where(is_ring_sound(corners, twin, v[n], start[n], size[n]), 1, 0)


def integers(values):
    return wp.array(np.array(values, dtype=np.int32), dtype=wp.int32, device="cpu")


def vectors(values):
    return wp.array(np.float32(values).reshape(-1, 3), dtype=wp.vec3, device="cpu")


def patch_of(quads):
    """Return patches of several regions, of which one has these quads."""
    patch = np.full((REGIONS, PATCH), 10**6, np.int32)
    patch[REGION, : len(quads)] = quads
    return integers(patch)


def rough_quads(rng, count):
    """Return corners of quads, (count, 4, 3): squares less and more bent, and every other one degenerate."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    quads = np.float32(square + rng.normal(size=(count, 4, 3)) * rng.choice([0, 0.1, 1], (count, 1, 1)))
    for n in range(1, count, 2):
        one, other = rng.choice(4, 2, replace=False)
        quads[n, one] = quads[n, other]
        if n % 4 == 3:
            quads[n] = quads[n, 0]
    return quads


@pytest.mark.parametrize("count", [1, 16, 17, 40])
def test_quads_side_by_side_measure_what_they_do_one_by_one(count):
    rng = np.random.default_rng(count)
    places = rough_quads(rng, 48).reshape(-1, 3)
    normals = rng.normal(size=places.shape)
    order = rng.permutation(48)[:count]
    inputs = [integers(np.arange(len(places))), vectors(places), vectors(normals), patch_of(order), REGION]
    measured = wp.zeros((REGIONS, MEASURES, PATCH), dtype=wp.float32, device="cpu")
    told = wp.full((MEASURES, count), 9.0, dtype=wp.float32, device="cpu")
    wp.launch(measure_kernel, 1, [*inputs, count, measured], device="cpu")
    wp.launch(scalar_kernel, count, [*inputs, told], device="cpu")
    assert np.array_equal(
        measured.numpy()[REGION, :, :count].copy().view(np.int32), told.numpy().view(np.int32)
    )
    assert not measured.numpy()[[0, 2]].any()
    assert np.isfinite(told.numpy()).all()


class Folded:
    """A torus with vertices off their places, so that many of its sides are folds."""

    def __init__(self, seed):
        self.points, self.quads = torus(6, 6)
        self.rng = np.random.default_rng(seed)
        self.points = np.float32(self.points + self.rng.normal(size=self.points.shape) * 0.5)
        self.mesh = working((self.points, self.quads)).arrays
        self.region = np.full(len(self.points), REGION)

    def told(self, patch):
        """Return how many sides of a patch's quads are told to be folds."""
        told = wp.full(1, -7, dtype=wp.int32, device="cpu")
        mesh = self.mesh
        inputs = [mesh.corners, mesh.twin, mesh.position, integers(self.region), patch_of(patch), REGION]
        wp.launch(fold_kernel, 1, [*inputs, len(patch), told], device="cpu")
        return int(told.numpy()[0])

    def expected(self, patch):
        """Return how many there are by areas in double precision."""
        a, b, c, d = np.moveaxis(self.points.astype(float)[self.quads], 1, 0)
        areas = np.cross(c - a, d - b)
        quad_at = {}
        for q, quad in enumerate(self.quads.tolist()):
            quad_at.update({(quad[n], quad[n - 3]): q for n in range(4)})
        found = 0
        for q in patch:
            quad = self.quads[q].tolist()
            across = [quad_at[quad[n - 3], quad[n]] for n in range(4)]
            found += sum(areas[q] @ areas[other] < 0 for other in across)
        return found


@pytest.mark.parametrize("count", [1, 16, 17, 36])
def test_folded_sides_are_those_between_quads_that_face_apart(count):
    told = []
    for seed in range(6):
        folded = Folded(seed)
        patch = folded.rng.permutation(36)[:count]
        told.append(folded.told(patch))
        assert told[-1] == folded.expected(patch)
    assert max(told) > 0


def test_sides_whose_ends_are_both_of_other_regions_are_not_looked_across():
    folded = Folded(3)
    patch = folded.rng.permutation(36)[:20]
    edges = {tuple(sorted((quad[n], quad[n - 3]))) for quad in folded.quads.tolist() for n in range(4)}
    own = {tuple(sorted((quad[n], quad[n - 3]))) for quad in folded.quads[patch].tolist() for n in range(4)}
    right = folded.expected(patch)
    for v, w in sorted(edges):
        folded.region[[v, w]] = 0, 2
        assert folded.told(patch) == (-1 if (v, w) in own else right)
        folded.region[v] = REGION
        assert folded.told(patch) == right
        folded.region[w] = REGION


def test_no_quad_comes_into_a_patch_twice_and_a_full_one_says_so():
    rng = np.random.default_rng(0)
    quads = np.concatenate([rng.integers(0, 40, 100), rng.permutation(PATCH + 3), np.arange(PATCH)])
    patch, told = patch_of([]), wp.zeros(len(quads), dtype=wp.int32, device="cpu")
    wp.launch(add_kernel, 1, [patch, REGION, integers(quads), told], device="cpu")
    listed, sizes = [], []
    for q in quads.tolist():
        full = q not in listed and len(listed) == PATCH
        if q not in listed and not full:
            listed.append(q)
        sizes.append(len(listed) + full)
    assert PATCH + 1 in sizes
    assert told.numpy().tolist() == sizes
    assert patch.numpy()[REGION].tolist() == listed
    assert (patch.numpy()[[0, 2]] == 10**6).all()


@pytest.mark.parametrize("before", [0, PATCH - 6])
def test_rings_come_into_a_patch_in_their_order_until_it_is_full(before):
    points, quads = sphere(4)
    mesh = working((points, quads)).arrays
    vertices = np.random.default_rng(before).permutation(len(points))[:10]
    starts, sizes = mesh.vertex_halfedge.numpy()[vertices], mesh.valence.numpy()[vertices]
    patch, told = patch_of(1000 + np.arange(before)), wp.zeros(10, dtype=wp.int32, device="cpu")
    inputs = [mesh.twin, patch, REGION, before, integers(starts), integers(sizes)]
    wp.launch(add_ring_kernel, 1, [*inputs, told], device="cpu")
    listed = (1000 + np.arange(before)).tolist()
    for n, (v, start) in enumerate(zip(vertices, starts, strict=True)):
        more = [q for q in ring_round(quads, v, start // 4) if q not in listed]
        is_full = len(listed) + len(more) > PATCH
        listed = (listed + more)[:PATCH]
        assert told.numpy()[n] == len(listed) + is_full
    found = patch.numpy()[REGION]
    assert found[found < 10**6].tolist() == listed
    assert (len(listed) == PATCH) == (before > 0)


def ring_round(quads, v, q):
    """Return the quads round a vertex counter-clockwise from one on."""
    ends = {}
    for other in np.flatnonzero((quads == v).any(axis=1)).tolist():
        at = quads[other].tolist().index(v)
        ends[int(quads[other, at - 3])] = (other, int(quads[other, at - 1]))
    ring, after = [int(q)], int(quads[q, quads[q].tolist().index(v) - 1])
    while ends[after][0] != q:
        ring.append(ends[after][0])
        after = ends[after][1]
    return ring


def told_sound(quads, twin, vertices, starts, sizes):
    """Return for each vertex whether it is told to be sound."""
    told = wp.full(len(vertices), -1, dtype=wp.int32, device="cpu")
    inputs = [
        integers(np.ravel(quads)),
        integers(twin),
        integers(vertices),
        integers(starts),
        integers(sizes),
    ]
    wp.launch(sound_kernel, len(vertices), [*inputs, told], device="cpu")
    return told.numpy().astype(bool).tolist()


def is_sound(quads, v, size):
    """Return by sets whether quads form one ring of 3 to 8 round a vertex, without a vertex twice."""
    round_v = [tuple(quad) for quad in np.asarray(quads).tolist() if v in quad]
    if size != len(round_v) or not 3 <= size <= 8 or any(quad.count(v) > 1 for quad in round_v):
        return False
    sides = [{quad[quad.index(v) - 1], quad[quad.index(v) - 3]} for quad in round_v]
    opposite = {quad[quad.index(v) - 2] for quad in round_v}
    near = set().union(*sides)
    reached = set(sides[0])
    for _ in sides:
        reached |= set().union(*(side for side in sides if side & reached))
    return len(near) == len(opposite) == size and not near & opposite and reached == near


def fan(size):
    """Return quads round vertex 0 and their twins at sides that end there."""
    quads = [(0, 2 * n + 1, 2 * n + 2, (2 * n + 2) % (2 * size) + 1) for n in range(size)]
    twin = np.full(4 * size, -1)
    for n in range(size):
        after = (n + 1) % size
        twin[4 * n + 3], twin[4 * after] = 4 * after, 4 * n + 3
    return quads, twin


@pytest.mark.parametrize("shape", [cube(), torus(5, 4), torus(2, 5), sphere(3), corner_to_corner_cubes()])
def test_rings_of_closed_meshes_are_sound_as_sets_say(shape):
    mesh = working(shape).arrays
    vertices, sizes = np.arange(len(shape[0])), mesh.valence.numpy()
    for more in (-1, 0, 1):
        told = told_sound(shape[1], mesh.twin.numpy(), vertices, mesh.vertex_halfedge.numpy(), sizes + more)
        count = (shape[1].ravel() == vertices[:, None]).sum(axis=1)
        assert told == [is_sound(shape[1], v, size) for v, size in zip(vertices, sizes + more, strict=True)]
        assert more == 0 or not any(np.array(told)[count == sizes])


@pytest.mark.parametrize("size", range(2, 10))
def test_a_ring_is_sound_from_3_to_8_quads_unless_it_has_a_vertex_twice(size):
    quads, twin = fan(size)
    for start in range(size):
        assert told_sound(quads, twin, [0], [4 * start], [size]) == [3 <= size <= 8]
    assert is_sound(quads, 0, size) == (3 <= size <= 8)
    for kept in range(2 * size + 1):
        for merged in range(kept + 1, 2 * size + 1):
            welded = np.where(np.array(quads) == merged, kept, quads)
            assert not is_sound(welded, 0, size)
            assert told_sound(welded, twin, [0], [0], [size]) == [False]
