"""Keep the mesh that quads are taken away from, and hold what becomes of it against that, in millimetres.

A bound on the distance holds for the mesh that is written. So stages that move vertices afterwards have
theirs taken back where they break it.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray, Float64Array
from dmc_cli.errors import SettingsError
from dmc_cli.measures import MeshDistance, NearestFaces, measure_distance, measure_quality, prove_proximity
from dmc_cli.mesh import Mesh, Placement
from dmc_cli.volume import Volume

ALIKE = 1e-9
"""How much lengths along axes may differ, as a share, that are taken for the same."""

MOST_RINGS = 5
"""Rings of faces whose vertices are taken back round one that is to blame, until all are."""


def to_millimetres(affine: Float64Array, volume: Volume, *, has_depths: bool) -> Float64Array:
    """Return the map from differences of coordinates to those in the volume's millimetres, shape (3, 3).

    Args:
        affine: Shape (4, 4): node index, slices even, to the coordinates.
        volume: The volume.
        has_depths: Whether coordinates lie where slices do, if these are at uneven distances.

    Raises:
        SettingsError: Coordinates are grid indices, and slices lie at uneven distances.
    """
    if volume.slice_positions is not None and not has_depths:
        raise SettingsError(
            "a length in mm was asked for, but coordinates are grid indices of slices at uneven distances;"
            " expected coordinates that lengths are proportional to; choose another --space"
        )
    found: Float64Array = volume.affine[:3, :3] @ np.linalg.inv(affine[:3, :3])
    return found


def in_millimetres(mesh: Mesh, to_mm: Float64Array) -> Mesh:
    """Return a mesh with positions in millimetres, itself where these are; axes may point elsewhere."""
    if np.allclose(to_mm.T @ to_mm, np.eye(3), rtol=0.0, atol=ALIKE):
        return mesh
    points = mesh.positions.numpy().astype(np.float64) @ to_mm.T
    return replace(
        mesh, positions=wp.array(points.astype(np.float32), dtype=wp.vec3, device=mesh.device.name)
    )


class FineMesh:
    """The mesh before quads were taken away, and how far another may be from it."""

    def __init__(self, mesh: Mesh, to_mm: Float64Array, max_error: float | None) -> None:
        """Take a mesh; `max_error` is in millimetres, which `to_mm`, shape (3, 3), maps coordinates to."""
        self.to_mm, self.max_error = to_mm, max_error
        bare = Mesh(mesh.positions, mesh.faces, mesh.device, triangle_count=mesh.triangle_count)
        self._mesh = in_millimetres(bare, self.to_mm)
        self._nearest: NearestFaces | None = None

    def find_beyond(self, mesh: Mesh) -> BoolArray:
        """Return which faces of a mesh are to blame where distances exceed `max_error`, bool (F,)."""
        assert self.max_error is not None
        self._nearest = self._nearest or NearestFaces(self._mesh)
        mesh = in_millimetres(mesh, self.to_mm)
        beyond = prove_proximity(mesh, self._nearest, self.max_error).beyond
        back = prove_proximity(self._mesh, NearestFaces(mesh), self.max_error)
        beyond[back.near_beyond] = True
        return beyond

    def distance_of(self, mesh: Mesh) -> MeshDistance:
        """Return the distances of a mesh to and from this one, in millimetres."""
        return measure_distance(in_millimetres(mesh, self.to_mm), self._mesh)

    def take_back(
        self, mesh: Mesh, placement: Placement | None, before: tuple[Mesh, Placement | None]
    ) -> tuple[Mesh, Placement | None, int]:
        """Return a mesh with vertices where they were before wherever they break the bound, and how many.

        Args:
            mesh: Of the same faces as before; its vertices have moved.
            placement: Where they lie on a field's surface, if there is one.
            before: The same before they moved, within the bound.
        """
        faces, is_back = mesh.faces.numpy(), np.zeros(mesh.vertex_count, bool)
        least = min(measure_quality(one).shape_min or 0.0 for one in (mesh, before[0]))
        found = (mesh, placement)
        for ring in range(MOST_RINGS + 1):
            beyond = self.find_beyond(found[0])
            if not beyond.any() and (measure_quality(found[0]).shape_min or 0.0) >= least:
                return *found, int(is_back.sum())
            for _step in range(ring + 1):
                is_back[faces[beyond]] = True
                beyond |= is_back[faces].any(axis=1)
            found = _mixed(mesh, placement, before, is_back)
        return *before, mesh.vertex_count


def _mixed(
    mesh: Mesh, placement: Placement | None, before: tuple[Mesh, Placement | None], is_back: BoolArray
) -> tuple[Mesh, Placement | None]:
    """Return a mesh with some vertices, bool (V,), where they were before."""

    def chosen(old: Any, new: Any, kind: Any) -> Any:
        old, new = old.numpy(), new.numpy()
        is_old = is_back if new.ndim == 1 else is_back[:, None]
        return wp.array(np.where(is_old, old, new), dtype=kind, device=mesh.device.name)

    old, mesh = before[1], replace(mesh, positions=chosen(before[0].positions, mesh.positions, wp.vec3))
    if placement is None or old is None:
        return mesh, None
    cell = chosen(old.cell, placement.cell, wp.int64)
    local = chosen(old.local, placement.local, wp.vec3)
    return mesh, replace(placement, cell=cell, local=local)
