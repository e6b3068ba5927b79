"""Hold samples of quads against the tracked points that a region has listed, many side by side.

A patch has some ten points to a hundred, and each is held against dozens of samples each time that something
is tried. So their places and normals are copied side by side, and places looked for with vectors of the
processor (`fine_points.h`): a lane is a point where one place asks for the nearest, and a sample where many
ask for their heights.
"""

import warp as wp

from dmc_cli.processing.decimation.guard import MOST_STEPS
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

ROW_STEP = 16
"""What the lengths of the rows of copies are multiples of: a vector's lanes."""

ROWS = 6
"""Rows of copies: x, y, z and those of the normal."""

PLACES = 6
"""Places among which the best for a vertex is looked for at once, its own among them."""

LEAST_GAIN = 1.0e-4
"""Of energy: what a step must be worth."""

HEIGHT_WEIGHT = 3.5
"""What the square of a sample's height, against the mean side, counts against 1 - shape."""

HIGH_WEIGHT = 10.0
"""How much more the square of a height counts, for each unit of it: the largest heights count most."""

BAD_WEIGHT = 0.5
"""How much more a quad of shape 0 counts than one that is nearly a square."""


@wp.func_native(native(__file__, "copy_points"))
def copy_points(
    place: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    listed: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    copies: wp.array3d(dtype=wp.float32),
) -> None:
    """Copy the places and normals of a region's `count` listed points side by side."""
    ...


@wp.func_native(native(__file__, "nearest_copy"))
def nearest_copy(copies: wp.array3d(dtype=wp.float32), b: wp.int32, count: wp.int32, x: wp.vec3) -> wp.int32:
    """Return the number of the point that is nearest to a place, the first of those as near; -1 of none."""
    ...


@wp.func_native(native(__file__, "are_samples_low", MOST_STEPS=int(MOST_STEPS)))
def are_samples_low(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    patch: wp.array2d(dtype=wp.int32),
    patched: wp.int32,
    copies: wp.array3d(dtype=wp.float32),
    b: wp.int32,
    count: wp.int32,
    spacing: wp.float32,
    reach: wp.float32,
    highest: wp.float32,
) -> wp.bool:
    """Return whether samples of a patch's quads are at most `highest` from the surface.

    The height of a sample is that above the tangent plane of the nearest point; where that is beside it by
    more than `reach`, the rest is added. A quad has samples on its sides and inside, but not at its corners:
    it is divided like a bilinear patch in steps of at most `spacing`, at least 2 and at most `MOST_STEPS`.
    """
    ...


@wp.func_native(
    native(
        __file__,
        "best_place",
        PLACES=PLACES,
        LEAST_GAIN=LEAST_GAIN,
        HEIGHT_WEIGHT=HEIGHT_WEIGHT,
        HIGH_WEIGHT=HIGH_WEIGHT,
        BAD_WEIGHT=BAD_WEIGHT,
    )
)
def best_place(
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
) -> wp.int32:
    """Return which of a region's `PLACES` places is best for the vertex where halfedge `start` begins.

    The first, number 0, is where the vertex is; another must be better by `LEAST_GAIN`. Best is that with the
    least energy of the quads round the vertex. Their samples are the midpoints of sides and diagonals, and
    one near the vertex. A sample costs what its height does, against the mean side `edge`, but at most what
    one of a whole side would.
    """
    ...
