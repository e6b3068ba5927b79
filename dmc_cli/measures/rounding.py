"""Tell what the rounding of coordinates to float32 costs.

A vertex is exact where it is a cell and local coordinates; a file holds float32 numbers, whose steps grow
with the distance from the origin. Up to `COARSE` of a spacing nobody sees it. Beyond, vertices lie beside the
surface, at last on few positions, so it is told, and what is measured are the positions as they are written.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.mesh import COARSE, HALF_STEP, Mesh, Placement, SurfaceFrame
from dmc_cli.notices import Notice
from dmc_cli.runtime import load_kernels
from dmc_cli.volume import Volume

SMALLEST_STEP = float(np.finfo(np.float32).smallest_subnormal)
"""No numbers of float32 are closer: a point near the origin is off by up to half of it along each axis."""


@dataclass(frozen=True, kw_only=True)
class Rounding:
    """How far rounding moves vertices at most: in mm, and along an axis as a share of the spacing."""

    mm: float
    relative: float


def may_be_coarse(frame: SurfaceFrame) -> bool:
    """Return whether coordinates of the grid are so large that rounding may count; costs nothing."""
    linear, origin = frame.affine[:3, :3], frame.affine[:3, 3]
    farthest = np.abs(linear) @ (frame.grid.nx, frame.grid.ny, frame.grid.nz) + np.abs(origin)
    half_steps = np.maximum(HALF_STEP * farthest, 0.5 * SMALLEST_STEP)
    return bool((np.abs(np.linalg.inv(linear)) @ half_steps).max() > COARSE)


def file_rounding(points: Any, volume: Volume, unit_length: float = 1.0) -> Rounding:
    """Return how far rounding may have moved a file's points, (V, 3) float64, within a volume.

    `unit_length` is the length of the file's unit in millimetres.

    Points that are no float32 numbers were not rounded to them.
    """
    if not len(points) or (points != points.astype(np.float32)).any():
        return Rounding(mm=0.0, relative=0.0)
    steps = 0.5 * np.spacing(np.abs(points).max(axis=0).astype(np.float32)).astype(np.float64)
    steps *= unit_length
    in_cells = np.abs(np.linalg.inv(volume.affine[:3, :3])) @ steps
    return Rounding(mm=float(np.linalg.norm(steps)), relative=float(in_cells.max()))


def rounding_warnings(mesh: Mesh, placement: Placement, volume: Volume) -> tuple[Notice, ...]:
    """Return what is to be told of a mesh's coordinates, if float32 is too coarse for them."""
    if not may_be_coarse(placement.frame):
        return ()
    from dmc_cli.measures import rounding_kernels

    load_kernels(mesh.device, [rounding_kernels])
    warning = rounding_warning(rounding_kernels.measure_rounding(mesh, placement, volume))
    return () if warning is None else (warning,)


def rounding_warning(rounding: Rounding | None) -> Notice | None:
    """Return what a user should know of the rounding, or None if it is not worth a word."""
    if rounding is None or rounding.relative <= COARSE:
        return None
    cause, remedy = cause_and_remedy(rounding.mm)
    return Notice(
        "W-ROUNDING",
        f"{cause} float32 coordinates are off by up to {rounding.mm:.2g} mm, {rounding.relative:.2g} of the"
        f" spacing; write grid coordinates with --space voxel, or {remedy}",
    )


def cause_and_remedy(mm: float) -> tuple[str, str]:
    """Return why coordinates are so many millimetres off, as a message begins, and what else would help."""
    if mm <= SMALLEST_STEP:
        return "with so small a spacing", "choose a larger spacing"
    return "so far from the origin", "move the volume's origin"
