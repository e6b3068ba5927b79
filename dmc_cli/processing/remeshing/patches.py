"""List and measure the quads of a patch, many side by side (`patches.h`)."""

import warp as wp

from dmc_cli.processing.remeshing.work import PATCH
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SHAPE, WARP_COSINE, RISE = range(3)
"""Rows of what is measured of quads: equation 9, cosine of the warp, and area times the corners' normals."""

MEASURES = 3
"""How many rows these are."""


@wp.func_native(native(__file__, "add_to_patch", PATCH=PATCH))
def add_to_patch(patch: wp.array2d(dtype=wp.int32), b: wp.int32, count: wp.int32, q: wp.int32) -> wp.int32:
    """Add a quad to a patch of `count` unless it is there; return its size then: `PATCH` + 1, it is full."""
    ...


@wp.func_native(native(__file__, "add_ring_to_patch", PATCH=PATCH))
def add_ring_to_patch(
    twin: wp.array(dtype=wp.int32),
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    start: wp.int32,
    quads: wp.int32,
) -> wp.int32:
    """Add the `quads` quads round the vertex where halfedge `start` does, as `add_to_patch` does."""
    ...


@wp.func_native(native(__file__, "measure_quads"))
def measure_quads(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    measured: wp.array3d(dtype=wp.float32),
) -> None:
    """Measure the `count` quads of a patch."""
    ...


@wp.func_native(native(__file__, "count_folded_sides"))
def count_folded_sides(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    vertex_region: wp.array(dtype=wp.int32),
    patch: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
) -> wp.int32:
    """Return how many sides of a patch's quads are folds; -1 if another region's quad may lie across one."""
    ...
