"""Nearest points, heights of samples and the best places, looked for side by side, are those of NumPy."""

import itertools

import numpy as np
import pytest
import warp as wp

from dmc_cli.processing.decimation.fine_points import (
    BAD_WEIGHT,
    HEIGHT_WEIGHT,
    HIGH_WEIGHT,
    LEAST_GAIN,
    PLACES,
    are_samples_low,
    best_place,
    copy_points,
    nearest_copy,
)
from tests.mesh.hand_made import working

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

MOST_STEPS = 12
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
REGION, REGIONS, ROOM = 1, 3, 48


@wp.kernel
def nearest_kernel(
    place: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    listed: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    copies: wp.array3d(dtype=wp.float32),
    asked: wp.array(dtype=wp.vec3),
    told: wp.array(dtype=wp.int32),
):
    copy_points(place, normal, listed, b, count, copies)
    for n in range(asked.shape[0]):
        told[n] = nearest_copy(copies, b, count, asked[n])


@wp.kernel
def low_kernel(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    patch: wp.array2d(dtype=wp.int32),
    patched: wp.int32,
    copies: wp.array3d(dtype=wp.float32),
    b: wp.int32,
    count: wp.int32,
    spacing: wp.float32,
    reach: wp.float32,
    highest: wp.array(dtype=wp.float32),
    told: wp.array(dtype=wp.int32),
):
    n = wp.tid()
    low = are_samples_low(corners, position, patch, patched, copies, b, count, spacing, reach, highest[n])
    told[n] = wp.where(low, 1, 0)


@wp.kernel
def best_kernel(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    places: wp.array2d(dtype=wp.vec3),
    copies: wp.array3d(dtype=wp.float32),
    b: wp.int32,
    count: wp.int32,
    start: wp.int32,
    valence: wp.int32,
    edge: wp.float32,
    reach: wp.float32,
    told: wp.array(dtype=wp.int32),
):
    told[0] = best_place(corners, twin, position, places, copies, b, count, start, valence, edge, reach)


class Points:
    """Points with normals, of which a region has listed some, and the copies of these."""

    def __init__(self, places, normals, count, seed=0):
        self.order = np.random.default_rng(seed).permutation(len(places))[:count]
        self.places = np.float32(places)[self.order]
        self.normals = np.float32(normals)[self.order]
        self.count = count
        listed = np.full((REGIONS, ROOM), 10**6, np.int32)
        listed[REGION, :count] = self.order
        self.all = [vectors(places), vectors(normals), wp.array(listed, dtype=wp.int32, device="cpu")]
        self.copies = wp.zeros((REGIONS, 6, ROOM), dtype=wp.float32, device="cpu")

    def nearest(self, asked):
        """Copy the points, and return the numbers of those nearest to places."""
        told = wp.full(len(asked), -7, dtype=wp.int32, device="cpu")
        wp.launch(
            nearest_kernel,
            1,
            [*self.all, REGION, self.count, self.copies, vectors(asked), told],
            device="cpu",
        )
        return told.numpy()

    def heights(self, samples, reach):
        """Return how high samples are, in double precision."""
        off = samples[:, None] - self.places.astype(float)
        squares = (off**2).sum(axis=2)
        best = squares.argmin(axis=1)
        every = np.arange(len(samples))
        height = np.abs((off[every, best] * self.normals[best].astype(float)).sum(axis=1))
        beside = np.sqrt(np.maximum(squares[every, best] - height**2, 0))
        return height + np.maximum(beside - reach, 0)


def vectors(values):
    return wp.array(np.float32(values).reshape(-1, 3), dtype=wp.vec3, device="cpu")


def unit(normals):
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def scattered(rng, count, total=60):
    """Points near the unit square, with normals up, more or less; those listed include one that has none."""
    places = rng.uniform([-0.2, -0.2, -0.05], [1.2, 1.2, 0.05], (total, 3))
    points = Points(places, unit(rng.normal([0, 0, 3], 0.5, (total, 3))), count)
    if count > 1:
        normals = points.all[1].numpy()
        normals[points.order[1]] = points.normals[1] = 0
        points.all[1] = vectors(normals)
    points.nearest(places[:1])
    return points


def samples_of(quad, spacing):
    """Return places on a quad's sides and inside it, but not at its corners."""
    longest = np.linalg.norm(quad - np.roll(quad, -1, axis=0), axis=1).max()
    steps = int(np.clip(np.ceil(longest / spacing), 2, MOST_STEPS))
    a, b, c, d = quad
    shares = [
        (i / steps, j / steps)
        for i, j in itertools.product(range(steps + 1), repeat=2)
        if {i, j} - {0, steps}
    ]
    return np.array([(1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * d + s * c) for s, t in shares])


def are_low(quads, order, points, spacing, reach, limits):
    """Return for each limit whether the samples of quads, a patch in this order, are as low."""
    patch = np.full((REGIONS, 24), 10**6, np.int32)
    patch[REGION, : len(order)] = order
    told = wp.full(len(limits), -1, dtype=wp.int32, device="cpu")
    inputs = [
        wp.array(np.arange(4 * len(quads), dtype=np.int32), dtype=wp.int32, device="cpu"),
        vectors(quads),
        wp.array(patch, dtype=wp.int32, device="cpu"),
        len(order),
        points.copies,
        REGION,
        points.count,
        spacing,
        reach,
        wp.array(np.float32(limits), dtype=wp.float32, device="cpu"),
    ]
    wp.launch(low_kernel, len(limits), [*inputs, told], device="cpu")
    return told.numpy().tolist()


def shape_of(quad):
    """Return the shape of equation 9, in double precision."""
    sides = np.roll(quad, -1, axis=0) - quad
    normal = np.cross(sides[0] - sides[2], sides[1] - sides[3])
    shapes = []
    for before, after in zip(np.roll(sides, 1, axis=0), sides, strict=True):
        turn = np.cross(before, after)
        squares = before @ before + after @ after
        shapes.append(2 * np.sign(turn @ normal) * np.linalg.norm(turn) / squares)
    return min(shapes)


def energy(ring, points, edge, reach):
    """Return the energy of quads whose first corner is the vertex, in double precision."""
    total = 0.0
    for here, beside, across, other in ring:
        miss = 1 - shape_of(np.array([here, beside, across, other]))
        samples = [(here + beside) / 2, (here + across) / 2, (beside + other) / 2]
        samples.append((9 * here + 3 * beside + 3 * other + across) / 16)
        height = np.minimum(points.heights(np.array(samples), reach) / edge, 1)
        total += miss * (1 + BAD_WEIGHT * miss)
        total += HEIGHT_WEIGHT * (height**2 * (1 + HIGH_WEIGHT * height**2)).sum()
    return total


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 40])
def test_listed_points_are_copied_and_the_nearest_is_numpys(count):
    rng = np.random.default_rng(count)
    places, normals = rng.uniform(-1, 1, (60, 3)), unit(rng.normal(size=(60, 3)))
    points = Points(places, normals, count)
    asked = np.vstack([[0, 0, 0], rng.uniform(-1.5, 1.5, (200, 3))]).astype(np.float32)
    told = points.nearest(asked)
    copies = points.copies.numpy()
    assert np.array_equal(copies[REGION, :3, :count].T, points.places)
    assert np.array_equal(copies[REGION, 3:, :count].T, points.normals)
    assert not copies[[0, 2]].any()
    if count == 0:
        assert (told == -1).all()
    else:
        off = points.places - asked[:, None]
        squares = off[..., 0] * off[..., 0] + off[..., 1] * off[..., 1] + off[..., 2] * off[..., 2]
        assert squares.dtype == np.float32
        assert np.array_equal(told, squares.argmin(axis=1))


@pytest.mark.parametrize("count", [1, 15, 16, 17, 40])
def test_of_points_as_near_the_first_is_told(count):
    rng = np.random.default_rng(count)
    points = Points(rng.integers(-1, 2, (60, 3)), np.zeros((60, 3)), count)
    asked = np.array(list(itertools.product([-1, -0.5, 0, 0.5, 1], repeat=3)))
    squares = ((points.places - asked[:, None]) ** 2).sum(axis=2)
    assert np.array_equal(points.nearest(asked), squares.argmin(axis=1))
    if count > 16:
        assert ((squares == squares.min(axis=1, keepdims=True)).sum(axis=1) > 1).any()


@pytest.mark.parametrize("spacing", [5.0, 0.6, 0.3, 0.05])
@pytest.mark.parametrize("size", [1, 3, 20])
def test_samples_are_low_up_to_the_height_of_the_highest(size, spacing):
    rng = np.random.default_rng(size)
    for seed, count in enumerate([1, 7, 16, 40]):
        points = scattered(np.random.default_rng(seed), count)
        quads = np.float32(SQUARE + rng.uniform(-0.3, 0.3, (size + 2, 4, 3)) * [1, 1, 0.5])
        order = rng.permutation(size + 2)[:size]
        reach = 0.15
        heights = [points.heights(samples_of(quads[q].astype(float), spacing), reach) for q in order]
        largest = np.concatenate(heights).max()
        limits = [largest * (1 + 1e-4), largest * (1 - 1e-4)]
        assert are_low(quads, order, points, spacing, reach, limits) == [1, 0]


def test_each_sample_of_each_quad_of_a_patch_counts():
    # A point right below one sample of flat quads, the others' points at their own height, makes it highest
    for size, spacing in ((1, 5.0), (3, 0.4)):
        quads = np.float32([SQUARE + np.array([2 * n, 0, 0]) for n in range(size)])
        all_samples = np.vstack([samples_of(quad.astype(float), spacing) for quad in quads])
        for n in range(len(all_samples)):
            places = all_samples.copy()
            places[n, 2] = -0.05
            points = Points(places, np.tile([0.0, 0, 1], (len(places), 1)), len(places))
            points.nearest(places[:1])
            assert are_low(quads, range(size), points, spacing, 0.0, [0.051, 0.049]) == [1, 0]


def test_without_points_no_sample_is_low():
    points = Points(np.zeros((1, 3)), np.zeros((1, 3)), 0)
    points.nearest(np.zeros((1, 3)))
    assert are_low(SQUARE[None], [0], points, 1.0, 1.0, [1e6]) == [0]


class Ring:
    """A bent ring of quads round a vertex, in any order, each from any corner on, and points near it."""

    edge, reach = 0.3, 0.1

    def __init__(self, rng, valence, bend, count):
        angle = np.arange(2 * valence) * np.pi / valence
        size = np.where(np.arange(2 * valence) % 2, 1.3, 1.0)
        outer = np.stack([size * np.cos(angle), size * np.sin(angle), 0 * angle], axis=1)
        places = np.vstack([[0, 0, 0], outer]) * 0.5 + [0.5, 0.5, 0]
        self.places = np.float32(places + rng.uniform(-bend, bend, places.shape) * 0.5)
        ring = [(0, 2 * n + 1, 2 * n + 2, (2 * n + 2) % (2 * valence) + 1) for n in range(valence)]
        turned = [np.roll(quad, rng.integers(4)) for quad in ring]
        order = rng.permutation(valence)
        self.ring, self.valence = np.array(ring), valence
        self.mesh = working((self.places, np.array(turned, np.int32)[order])).arrays
        first = rng.integers(valence)
        self.start = 4 * int(first) + int(np.flatnonzero(turned[order[first]] == 0)[0])
        self.points = scattered(rng, count)

    def energy(self, place):
        """Return the energy where the vertex is at a place, in double precision."""
        places = self.places.astype(float)
        places[0] = place
        return energy(places[self.ring], self.points, self.edge, self.reach)

    def best(self, others):
        """Return the number of the best place, 0 for where the vertex is."""
        rows = np.full((REGIONS, PLACES, 3), 1e6, np.float32)
        rows[REGION] = [self.places[0], *others]
        told = wp.full(1, -7, dtype=wp.int32, device="cpu")
        inputs = [self.mesh.corners, self.mesh.twin, self.mesh.position]
        inputs += [wp.array(rows, dtype=wp.vec3, device="cpu"), self.points.copies, REGION, self.points.count]
        inputs += [self.start, self.valence, self.edge, self.reach]
        wp.launch(best_kernel, 1, [*inputs, told], device="cpu")
        return int(told.numpy()[0])

    def place_of_energy(self, wanted, good, bad):
        """Return where between two places energy crosses what is wanted, and what it is there."""
        for _ in range(40):
            middle = (good + bad) / 2
            is_above = self.energy(middle) > wanted
            good, bad = (good, middle) if is_above else (middle, bad)
        place = np.float32(good)
        return place, self.energy(place.astype(float))


@pytest.mark.parametrize("valence", [3, 4, 5, 8, 11])
@pytest.mark.parametrize("bend", [0.05, 0.4])
def test_the_place_of_least_energy_is_the_best(valence, bend):
    rng = np.random.default_rng(valence)
    found = set()
    for count in (1, 16, 40):
        for _ in range(8):
            ring = Ring(rng, valence, bend, count)
            others = np.float32(ring.places[0] + rng.uniform(-0.1, 0.1, (PLACES - 1, 3)))
            energies = [ring.energy(place.astype(float)) for place in (ring.places[0], *others)]
            energies[0] -= LEAST_GAIN
            if np.diff(np.sort(energies)[:2]) > 1e-4 * min(energies):
                found.add(ring.best(others))
                assert ring.best(others) == np.argmin(energies)
    assert len(found) > 3


@pytest.mark.parametrize("valence", [3, 4, 5, 8, 11])
@pytest.mark.parametrize("bend", [0.05, 0.4])
def test_a_place_is_taken_that_is_just_better(valence, bend):
    rng = np.random.default_rng(valence)
    told = set()
    for count in (1, 16, 16, 40, 40):
        ring = Ring(rng, valence, bend, count)
        least = ring.energy(ring.places[0]) - LEAST_GAIN
        margin = 2e-4 * least
        around = sorted(ring.places[0] + rng.uniform(-0.1, 0.1, (40, 3)), key=ring.energy)
        for is_better in (True, False):
            wanted = least - margin if is_better else least + margin
            if ring.energy(around[0]) < wanted:
                place, found = ring.place_of_energy(wanted, around[0], around[-1])
                if abs(found - wanted) < margin / 2:  # it jumps where another point comes to be the nearest
                    number = int(rng.integers(1, PLACES))
                    others = np.tile(ring.places[0], (PLACES - 1, 1))
                    others[number - 1] = place
                    assert ring.best(others) == (number if is_better else 0)
                    told.add(is_better)
    assert told == {True, False}
