"""Check every invariant of a finished mesh in plain NumPy, independently of the kernels."""

from typing import Any

import numpy as np

from dmc_cli.array_types import BoolArray
from dmc_cli.errors import MeshInvariantError
from dmc_cli.mesh.check_halfedges import check_halfedges, pieces
from dmc_cli.mesh.mesh import Mesh
from dmc_cli.mesh.near_frame import COARSE
from dmc_cli.mesh.placement import Placement
from dmc_cli.mesh_io import NO_CORNER
from dmc_cli.settings import ConvertSettings

UNIT_TOLERANCE = 1e-4
"""How far the length of a normal may be from 1: some float32 roundings."""

DEVIATION_TOLERANCE = 1e-5
"""Largest deviation of a vertex from the trilinear surface, as a share of the value range."""


def check_mesh(
    mesh: Mesh,
    placement: Placement,
    normals: Any | None,
    report: dict[str, Any],
    settings: ConvertSettings,
) -> None:
    """Raise MeshInvariantError with the first offender unless the mesh is what it is meant to be.

    It is meant to be a manifold, and on the surface, if its method promises that. The papers' bare rules of
    simplification promise nothing, so after them only the halfedges are checked.
    """
    topology, border = settings.surface.topology, settings.surface.border
    closed_or_split = settings.surface.is_manifold or (topology is not None and border == "closed")
    halfedges = mesh.require_halfedges()
    check_halfedges(
        mesh.faces.numpy(),
        halfedges.twin.numpy(),
        halfedges.vertex_halfedge.numpy(),
        one_fan=closed_or_split,
    )
    if not settings.mesh.follows_paper:
        _check_geometry(mesh, placement, normals, report, settings)


def _check_geometry(
    mesh: Mesh,
    placement: Placement,
    normals: Any | None,
    report: dict[str, Any],
    settings: ConvertSettings,
) -> None:
    """Raise unless vertices, faces and normals are sound, on the surface, and manifold if they are to be."""
    vertices, faces, local = mesh.positions.numpy(), mesh.faces.numpy(), placement.local.numpy()
    used = np.zeros(len(vertices), bool)
    for rows in pieces(len(vertices)):
        _require("vertex {} is not finite", np.isfinite(vertices[rows]).all(axis=1), rows)
        inside = (local[rows] >= 0) & (local[rows] <= 1)
        _require("vertex {} lies outside its cell", inside.all(axis=1), rows)
    for rows in pieces(len(faces)):
        there = (faces[rows] >= 0) & (faces[rows] < len(vertices))
        there[:, 3] |= faces[rows, 3] == NO_CORNER
        _require("face {} names a vertex that is not there", there.all(axis=1), rows)
        corners = np.sort(faces[rows], axis=1)
        _require("face {} has a vertex twice", (corners[:, 1:] != corners[:, :-1]).all(axis=1), rows)
        used[corners[corners >= 0]] = True
    _require("vertex {} is in no face", used)
    directions = np.empty((0, 3)) if normals is None else normals.numpy()
    for rows in pieces(len(directions)):
        length = np.linalg.norm(directions[rows], axis=1)
        _require("the normal of vertex {} has not length 1", np.abs(length - 1) <= UNIT_TOLERANCE, rows)
    measured = report["deviation"] or {}
    deviation, rounding = measured.get("max_relative"), measured.get("rounding_relative") or 0.0
    is_exact = settings.surface.is_on_surface
    is_exact = is_exact and (settings.mesh.project or settings.mesh.simplify in ("none", "3333"))
    is_exact = is_exact and rounding <= COARSE  # else it is that of the file's coordinates
    if is_exact and deviation is not None and deviation > DEVIATION_TOLERANCE:
        raise MeshInvariantError(
            f"a vertex deviates by {deviation:.3g} of the value range from the surface; expected at most"
            f" {DEVIATION_TOLERANCE:g}; please report this"
        )
    topology = report["topology"]
    if settings.surface.is_manifold:
        for key in ("non_manifold_edges", "non_manifold_vertices"):
            if topology[key]:
                raise MeshInvariantError(
                    f"{topology[key]} {key.replace('_', ' ')} were found; expected none; please report this"
                )


def _require(message: str, holds: BoolArray, rows: slice = slice(0, None)) -> None:
    """Raise with the index of the first item for which the condition does not hold; `rows` are the items."""
    if not holds.all():
        raise MeshInvariantError(message.format(rows.start + int(np.argmin(holds))) + "; please report this")
