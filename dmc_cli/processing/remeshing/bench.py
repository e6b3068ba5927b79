"""Set up what a sweep works on: the kernels' view of the mesh, and a bench for each region."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.mesh import WorkingMesh
from dmc_cli.processing.distance_guard import TrackedPoints, list_points
from dmc_cli.processing.relaxation import find_normals
from dmc_cli.processing.remeshing.patches import MEASURES
from dmc_cli.processing.remeshing.regions import Regions, with_spares
from dmc_cli.processing.remeshing.work import CORE, JOURNAL, LINKS, PATCH, TALLIES, TRACKED, Work
from dmc_cli.runtime import Device

VISITS = 4096
"""Of a region's items in one launch at most, which is a tenth of a second where all are irregular."""


def make_work(
    mesh: WorkingMesh, tracked: TrackedPoints, regions: Regions, vertices: int, context: Any
) -> Any:
    """Return the kernels' view of the mesh, which has room, of tracked points, and a bench a region.

    Args:
        mesh: The mesh, with the regions' spare places at its end.
        tracked: Its tracked points.
        regions: Its regions.
        vertices: Vertices before the spare places.
        context: The kernels' `SurfaceContext`.
    """
    work = Work()
    take_mesh(work, mesh, find_normals(context, mesh.arrays.cell, mesh.arrays.local, mesh.device))
    take_points(work, tracked, mesh)
    take_regions(work, regions, vertices, TRACKED, mesh.device)
    return work


def take_mesh(work: Any, mesh: WorkingMesh, normal: Any) -> None:
    """Give a sweep's view a mesh and the surface's unit normals at its vertices, vec3 (V,)."""
    work.mesh, work.sense, work.normal = mesh.arrays, mesh.frame.sense, normal


def take_points(work: Any, tracked: TrackedPoints, mesh: WorkingMesh) -> None:
    """Give it the mesh's tracked points."""
    work.tracked_point, work.nearest_quad = tracked.point, tracked.nearest_quad
    work.first_point, work.next_point = list_points(tracked, mesh.face_count, mesh.device)


def take_regions(work: Any, regions: Regions, vertices: int, points: int, device: Device) -> None:
    """Give it the regions of a sweep, and each a bench, with so many points of a patch's quads at most."""
    count = regions.count
    work.vertex_region = with_spares(regions, vertices, device)
    work.tally = device.zeros((count, TALLIES), wp.int32)
    work.journal_place = device.empty((count, JOURNAL), wp.int64)
    work.journal_value = device.empty((count, JOURNAL), wp.int32)
    work.chain = device.empty((count, LINKS), wp.int32)
    work.listed, work.new_nearest = (device.empty((count, points), wp.int32) for _ in range(2))
    work.core_valence = device.empty((count, CORE), wp.int32)
    work.core = device.empty((count, CORE), wp.int32)
    work.core_cell = device.empty((count, CORE), wp.int64)
    work.core_position = device.empty((count, CORE), wp.vec3)
    work.core_local = device.empty((count, CORE), wp.vec3)
    work.core_normal = device.empty((count, CORE), wp.vec3)
    work.patch = device.empty((count, PATCH), wp.int32)
    work.measured = device.empty((count, MEASURES, PATCH), wp.float32)


def portions(regions: Regions, passes: int) -> Iterator[tuple[int, int]]:
    """Yield portions of the visits of a region's vertices, `passes` each, as begin and end; at least one."""
    most = passes * int(np.diff(regions.starts.numpy()).max(initial=0))
    for begin in range(0, max(most, 1), VISITS):
        yield begin, begin + VISITS
