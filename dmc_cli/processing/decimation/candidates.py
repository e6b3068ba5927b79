"""List the quads that a round may collapse: those of each region, from the cheapest on."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Int64Array
from dmc_cli.mesh import WorkingMesh
from dmc_cli.processing.decimation.costs import NEVER, gather_regions_kernel, rate_kernel
from dmc_cli.processing.remeshing import Regions, find_starts_kernel


@dataclass(frozen=True)
class Candidates:
    """The quads of the regions, from the cheapest on.

    Attributes:
        starts: Where each region's quads start in `items`, int32 (R + 1,).
        items: Quads whose corners are all of one region, int32.
        threshold: What a collapse may cost.
        counts: Quads of each region that cost no more, int64 (R,).
    """

    starts: Any
    items: Any
    threshold: float
    counts: Int64Array


def find_candidates(
    mesh: WorkingMesh, regions: Regions, refused: Any, weight: Any, per_step: float, share: float
) -> Candidates:
    """Return the regions' quads; the cheapest `share` of those that can go set the threshold.

    Args:
        mesh: The mesh, without gaps.
        regions: Its regions.
        refused: How often each quad was refused, uint8 (Q,).
        weight: What its collapse costs more where quads are large, float32 (Q,).
        per_step: The factor of cost of a unit of irregularity.
        share: From 0 to 1.
    """
    device, arrays, faces, count = mesh.device, mesh.arrays, mesh.face_count, regions.count
    cost, region = device.empty(faces, wp.float32), device.empty(faces, wp.int32)
    items, keys, labels = (device.empty(2 * faces, t) for t in (wp.int32, wp.float32, wp.int32))
    inputs = [arrays.corners, arrays.valence, arrays.position, refused, weight, per_step]
    device.launch(rate_kernel, faces, [*inputs, regions.vertex_region, count], [cost, region, items])
    wp.copy(keys, cost, count=faces)
    wp.utils.radix_sort_pairs(keys, items, faces)  # both sorts are stable
    device.launch(gather_regions_kernel, faces, [region, items], [labels])
    wp.utils.radix_sort_pairs(labels, items, faces)
    starts = device.zeros(count + 2, wp.int32)
    device.launch(find_starts_kernel, faces + 1, [labels, faces, count], [starts])
    costs, owners = cost.numpy(), region.numpy()
    can_go = costs < NEVER
    if not can_go.any():
        return Candidates(starts, items, 0.0, np.zeros(count, np.int64))
    threshold = np.quantile(costs[can_go], share, method="higher")
    counts = np.bincount(owners[can_go & (costs <= threshold)], minlength=count)
    return Candidates(starts, items, float(threshold), counts.astype(np.int64))
