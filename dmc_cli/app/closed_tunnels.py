"""Tell which tunnels of the trilinear surface a method's mesh does not have, and where they are.

A mesh with one vertex for each polygon of a cell forms no tunnel inside a cell. To be a manifold, a method
may decide a face otherwise, which closes a tunnel through the two cells beside it or, seen from the other
side, cuts a bridge. Each adds 2 to the Euler characteristic of a closed surface.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array, IntArray
from dmc_cli.contouring import list_flips, list_tunnels
from dmc_cli.field import DeviceVolume
from dmc_cli.methods import method_named, methods_that
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume

LISTED = 1000
"""Tunnels whose places are told at most."""

AXES = "xyz"


@dataclass(frozen=True)
class ClosedTunnels:
    """The tunnels that a mesh does not have.

    Attributes:
        cells: Cells with a tunnel: lowest nodes, int64 (n, 3); -1 is the layer that a closed border adds.
        faces: Faces decided otherwise: a cell, and the axis of its high face, int64 (n, 4).
    """

    cells: IntArray
    faces: IntArray

    def places(self, volume: Volume) -> list[dict[str, Any]]:
        """Return cell, the axis of a face or None, and the middle in mm of each; at most `LISTED`."""
        centres = np.concatenate([self.cells + 0.5, _face_centres(self.faces)])[:LISTED]
        cells = np.concatenate([self.cells, self.faces[:, :3]])[: len(centres)]
        axes = [None] * len(self.cells) + [AXES[axis] for axis in self.faces[:, 3]]
        points = _world_points(volume, centres)
        return [
            {"cell": cell, "face": axis, "position": point}
            for cell, axis, point in zip(cells.tolist(), axes, points.tolist(), strict=False)
        ]


def find_closed_tunnels(volume: DeviceVolume, settings: SurfaceSettings) -> ClosedTunnels | None:
    """Return the tunnels that a method's mesh does not have; None where that is not known of the method.

    It is known of methods that decide faces as the trilinear surface does.
    """
    method = method_named(settings.method)
    forms_tunnels = method.list_tunnels is not None
    if not forms_tunnels and method.list_flips is None:
        return None
    flips = list_flips(volume, settings)
    if forms_tunnels:
        return ClosedTunnels(np.empty((0, 3), np.int64), flips)
    return ClosedTunnels(list_tunnels(volume, _with_tunnels(settings)), flips)


def _with_tunnels(settings: SurfaceSettings) -> SurfaceSettings:
    """Return the settings of the same surface by the method that forms its tunnels."""
    (name, *_) = methods_that(lambda method: method.list_tunnels is not None)
    return SurfaceSettings(
        isovalue=settings.settled_isovalue, method=name, inside=settings.inside, border=settings.border
    )


def _face_centres(faces: IntArray) -> Float64Array:
    """Return the middles of the high faces of cells, float64 (n, 3), in node indices."""
    return faces[:, :3] + 0.5 + 0.5 * np.eye(3)[faces[:, 3]]


def _world_points(volume: Volume, nodes: Float64Array) -> Float64Array:
    """Return points in the volume's space, in mm, from their node indices, float64 (n, 3)."""
    x, y, z = nodes.T
    if volume.slice_positions is not None:
        depths = np.asarray(volume.slice_positions, np.float64) / volume.spacing[2]
        lower = np.clip(np.floor(z), 0, len(depths) - 2).astype(np.int64)
        z = depths[lower] + (z - lower) * (depths[lower + 1] - depths[lower])
    return np.stack([x, y, z], axis=1) @ volume.affine[:3, :3].T + volume.affine[:3, 3]
