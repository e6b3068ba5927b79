"""Keep account of warped quads: remeshing leaves no more of them than came in, and none worse than the worst.

What the mesh has less of than at first is its *slack*: quads warped by over 30 degrees, the sum of how far
these are beyond it, and quads warped by over 60 degrees. Each sweep and mending shares it out among the
regions by their vertices, and what a region makes more of, it pays for. So regions need not look at each
other, and an operation never makes the whole have more than it came with (decision 29).
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.mesh import WorkingMesh
from dmc_cli.processing.quad_square import COS_LIMIT, COS_SEVERE, warp_cosine
from dmc_cli.processing.remeshing.checks import PatchMeasures, warp_excess
from dmc_cli.processing.remeshing.regions import Regions
from dmc_cli.processing.remeshing.work import EXCESS_LEFT, SEVERE_LEFT, WARPED_LEFT, Work
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

MOST_SLACK = 2**31 - 1
"""What is shared out at most."""


@dataclass(frozen=True)
class MeshWarp:
    """How a mesh is warped.

    Attributes:
        warped: Quads warped by over 30 degrees.
        excess: The sum of how far these are beyond it, in thousandths of the cosine.
        severe: Quads warped by over 60 degrees.
        largest: The largest excess of a quad.
    """

    warped: int
    excess: int
    severe: int
    largest: int

    def least_cosine(self) -> float:
        """Return the cosine of the largest warp, 0.001 more at most; that of 60 degrees if none is severe."""
        return min(COS_SEVERE, COS_LIMIT - 0.001 * self.largest)


def measure_warp(mesh: WorkingMesh) -> MeshWarp:
    """Measure how a mesh is warped."""
    warp = mesh.device.empty((3, mesh.face_count), wp.int32)
    inputs = [mesh.arrays.corners, mesh.arrays.position]
    mesh.device.launch(measure_warp_kernel, mesh.face_count, inputs, [warp])
    warped, excess, severe = mesh.device.totals(warp)
    return MeshWarp(warped, excess, severe, int(warp.numpy()[1].max(initial=0)))


def open_accounts(work: Any, regions: Regions, first: MeshWarp, now: MeshWarp, device: Device) -> None:
    """Share out what the mesh has less of `now` than at `first`."""
    less = (first.warped - now.warped, first.excess - now.excess, first.severe - now.severe)
    slack = wp.vec3i(*(min(max(n, 0), MOST_SLACK) for n in less))
    device.launch(open_accounts_kernel, regions.count, [slack, regions.starts, regions.count], [work])


@wp.func
def can_pay(work: Work, b: wp.int32, after: PatchMeasures, before: PatchMeasures) -> wp.bool:
    """Return whether a patch has no more warp than before, or the region has as much left."""
    warped = after.warped - before.warped
    excess = after.warp_excess - before.warp_excess
    severe = after.severe - before.severe
    fine = warped <= 0 or warped <= work.tally[b, WARPED_LEFT]
    fine = fine and (excess <= 0 or excess <= work.tally[b, EXCESS_LEFT])
    return fine and (severe <= 0 or severe <= work.tally[b, SEVERE_LEFT])


@wp.func
def pay(work: Work, b: wp.int32, after: PatchMeasures, before: PatchMeasures) -> None:
    """Book what warp a patch has more than before, or less."""
    work.tally[b, WARPED_LEFT] = work.tally[b, WARPED_LEFT] - (after.warped - before.warped)
    work.tally[b, EXCESS_LEFT] = work.tally[b, EXCESS_LEFT] - (after.warp_excess - before.warp_excess)
    work.tally[b, SEVERE_LEFT] = work.tally[b, SEVERE_LEFT] - (after.severe - before.severe)


@wp.func
def share(whole: wp.int32, from_item: wp.int32, to_item: wp.int32, items: wp.int32) -> wp.int32:
    """Return the share of some items in a row; the shares of all are the whole."""
    end = wp.int64(whole) * wp.int64(to_item) / wp.int64(items)
    return wp.int32(end - wp.int64(whole) * wp.int64(from_item) / wp.int64(items))


@wp.kernel
def measure_warp_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    # Out:
    warp_out: wp.array2d(dtype=wp.int32),
) -> None:
    """Tell of each quad whether it is warped, its excess, and whether it is severe. One thread a quad."""
    q = first + wp.tid()
    a = position[corners[4 * q]]
    b = position[corners[4 * q + 1]]
    c = position[corners[4 * q + 2]]
    d = position[corners[4 * q + 3]]
    cosine = warp_cosine(a, b, c, d)
    warp_out[0, q] = wp.where(cosine < COS_LIMIT, 1, 0)
    warp_out[1, q] = warp_excess(cosine)
    warp_out[2, q] = wp.where(cosine < COS_SEVERE, 1, 0)


@wp.kernel
def open_accounts_kernel(
    # In:
    first: wp.int32,
    slack: wp.vec3i,
    starts: wp.array(dtype=wp.int32),
    count: wp.int32,
    # In/out:
    work_inout: Work,
) -> None:
    """Give each region its share of the slack. One thread a region."""
    b = first + wp.tid()
    items = wp.max(starts[count], 1)
    work_inout.tally[b, WARPED_LEFT] = share(slack[0], starts[b], starts[b + 1], items)
    work_inout.tally[b, EXCESS_LEFT] = share(slack[1], starts[b], starts[b + 1], items)
    work_inout.tally[b, SEVERE_LEFT] = share(slack[2], starts[b], starts[b + 1], items)
