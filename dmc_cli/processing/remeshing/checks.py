"""Judge an operation: what it must leave, and what it is worth; device functions of remeshing.

Sound is a vertex with 3 to 8 quads in one ring whose vertices are all different: then no two quads are the
same or have two sides in common, no edge has more than two quads, and the mesh stays a manifold of the same
kind, since collapsing quads and splitting vertices change neither Euler characteristic nor components as
long as no two vertices of a ring become one.
"""

import warp as wp

from dmc_cli.field import index_position
from dmc_cli.processing.quad_square import COS_LIMIT, COS_SEVERE
from dmc_cli.processing.remeshing.patches import (
    RISE,
    SHAPE,
    WARP_COSINE,
    add_ring_to_patch,
    count_folded_sides,
    measure_quads,
)
from dmc_cli.processing.remeshing.work import (
    HAS_SPLIT,
    LONGEST_RING,
    MOST_VALENCE,
    PATCH,
    PATCHED,
    TOUCHED,
    Work,
    fail,
)
from dmc_cli.processing.surface_distance import (
    distance_from_surface,
    excess_height,
    height_above_surface,
    quad_centre,
)
from dmc_cli.processing.tangent_step import SurfaceContext
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SHAPE_WEIGHT = wp.constant(0.6)
"""What a quad's shape counts against the square of a vertex's distance from valence 4."""


@wp.struct
class PatchMeasures:
    """What is measured of a patch.

    Attributes:
        cost: The sum of 1 - shape.
        least: The least shape.
        inverted: Quads that are inverted.
        warped: Quads that are warped by over 30 degrees.
        warp_excess: The sum of how far these are beyond it.
        severe: Quads that are warped by over 60 degrees.
        warp_cosine: The cosine of the largest warp.
        folds: Folded sides.
    """

    cost: wp.float32
    least: wp.float32
    inverted: wp.int32
    warped: wp.int32
    warp_excess: wp.int32
    severe: wp.int32
    warp_cosine: wp.float32
    folds: wp.int32


@wp.func_native(native(__file__, "is_ring_sound", MOST_VALENCE=MOST_VALENCE))
def is_ring_sound(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    v: wp.int32,
    start: wp.int32,
    size: wp.int32,
) -> wp.bool:
    """Return whether the quads round a vertex form one ring of 3 to 8 without a vertex twice.

    `start` is the first of the vertex's `size` outgoing halfedges.
    """
    ...


@wp.func
def is_sound(work: Work, v: wp.int32) -> wp.bool:
    """Return whether a vertex is sound."""
    return is_ring_sound(
        work.mesh.corners, work.mesh.twin, v, work.mesh.vertex_halfedge[v], work.mesh.valence[v]
    )


@wp.func
def is_core_sound(work: Work, b: wp.int32) -> wp.bool:
    """Return whether all vertices that an operation touched and left are sound."""
    sound = bool(True)
    for n in range(work.tally[b, TOUCHED]):
        v = work.core[b, n]
        if sound and work.mesh.vertex_gone[v] == wp.uint8(0):
            sound = is_sound(work, v)
    return sound


@wp.func
def irregularity_change(work: Work, b: wp.int32) -> wp.int32:
    """Return what an operation adds to the sum of the squares of its vertices' distances from valence 4."""
    result = int(0)
    for n in range(work.tally[b, TOUCHED]):
        v = work.core[b, n]
        before = work.core_valence[b, n] - 4
        after = wp.where(work.mesh.vertex_gone[v] == wp.uint8(0), work.mesh.valence[v] - 4, 0)
        result += after * after - before * before
    return result


@wp.func
def quads_removed(work: Work, b: wp.int32) -> wp.int32:
    """Return how many quads, and as many vertices, an operation takes away."""
    gone = -work.tally[b, HAS_SPLIT]
    for n in range(work.tally[b, TOUCHED]):
        gone += wp.int32(work.mesh.vertex_gone[work.core[b, n]])
    return gone


@wp.func
def grow_patch(work: Work, b: wp.int32, count: wp.int32) -> None:
    """Note how many quads a patch has; fail if there is no room for the last."""
    if count > PATCH:
        fail(work, b)
    work.tally[b, PATCHED] = wp.min(count, PATCH)


@wp.func
def gather_patch(work: Work, b: wp.int32) -> None:
    """List the quads round the touched vertices, each once, in an order that the rings give."""
    work.tally[b, PATCHED] = 0
    for n in range(work.tally[b, TOUCHED]):
        v = work.core[b, n]
        if work.mesh.vertex_gone[v] == wp.uint8(0):
            size = wp.min(work.mesh.valence[v], LONGEST_RING)
            grow_patch(
                work,
                b,
                add_ring_to_patch(
                    work.mesh.twin,
                    work.patch,
                    b,
                    work.tally[b, PATCHED],
                    work.mesh.vertex_halfedge[v],
                    size,
                ),
            )


@wp.func
def warp_excess(cosine: wp.float32) -> wp.int32:
    """Return how far a quad's warp is beyond 30 degrees, as the difference of cosines in thousandths."""
    return wp.max(wp.int32(1000.0 * (COS_LIMIT - cosine)), 0)


@wp.func
def measure_patch(work: Work, b: wp.int32) -> PatchMeasures:
    """Return the measures of the patch's quads, without folds.

    A quad is inverted if it faces away from the mean of the surface's normals at its corners.
    """
    cost = float(0.0)
    least = float(1.0)
    inverted = int(0)
    warped = int(0)
    excess = int(0)
    severe = int(0)
    least_cosine = float(1.0)
    count = work.tally[b, PATCHED]
    measure_quads(work.mesh.corners, work.mesh.position, work.normal, work.patch, b, count, work.measured)
    for n in range(count):
        shape = work.measured[b, SHAPE, n]
        cost += 1.0 - shape
        least = wp.min(least, shape)
        inverted += wp.where(work.sense * work.measured[b, RISE, n] <= 0.0, 1, 0)
        cosine = work.measured[b, WARP_COSINE, n]
        warped += wp.where(cosine < COS_LIMIT, 1, 0)
        excess += warp_excess(cosine)
        severe += wp.where(cosine < COS_SEVERE, 1, 0)
        least_cosine = wp.min(least_cosine, cosine)
    found = PatchMeasures()
    found.cost = cost
    found.least = least
    found.inverted = inverted
    found.warped = warped
    found.warp_excess = excess
    found.severe = severe
    found.warp_cosine = least_cosine
    return found


@wp.func
def folded_sides(work: Work, b: wp.int32) -> wp.int32:
    """Return how many sides of the patch's quads are folds: the quads there over 90 degrees apart.

    It fails if there is a side that another region's quad may lie across, which must not be looked at.
    """
    found = count_folded_sides(
        work.mesh.corners,
        work.mesh.twin,
        work.mesh.position,
        work.vertex_region,
        work.patch,
        b,
        work.tally[b, PATCHED],
    )
    if found < 0:
        fail(work, b)
    return found


@wp.func
def highest_of_patch(context: SurfaceContext, work: Work, b: wp.int32) -> wp.float32:
    """Return the largest distance, in cells, of a patch quad's side's midpoint or centre from the surface."""
    highest = float(0.0)
    for n in range(work.tally[b, PATCHED]):
        q = work.patch[b, n]
        before = corner_index(context, work, 4 * q + 3)
        for c in range(4):
            here = corner_index(context, work, 4 * q + c)
            highest = wp.max(highest, height_above_surface(context, wp.float64(0.5) * (before + here)))
            before = here
        centre = quad_centre(context, work.mesh.corners, work.mesh.cell, work.mesh.local, q)
        highest = wp.max(highest, distance_from_surface(context, centre))
    return highest


@wp.func
def excess_of_patch(context: SurfaceContext, work: Work, b: wp.int32) -> wp.float32:
    """Return the sum of the excess heights of a patch's quads."""
    total = float(0.0)
    for n in range(work.tally[b, PATCHED]):
        total += excess_height(context, work.mesh.corners, work.mesh.cell, work.mesh.local, work.patch[b, n])
    return total


@wp.func
def corner_index(context: SurfaceContext, work: Work, h: wp.int32) -> wp.vec3d:
    """Return where a quad's corner is, in node indices."""
    v = work.mesh.corners[h]
    return index_position(context.grid, work.mesh.cell[v], work.mesh.local[v])
