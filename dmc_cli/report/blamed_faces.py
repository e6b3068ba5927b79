"""Find the faces that keep a mesh from being as required."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dmc_cli.array_types import BoolArray
from dmc_cli.measures import find_intersections, inspect_vertices, list_elements, mask_of_largest
from dmc_cli.mesh import Mesh, connect
from dmc_cli.requirements import WORDS, Comparison

_LEAST, _LARGEST = (">=", ">", "==", "="), ("<=", "<", "==", "=")

_OF_A_FACE: dict[str, tuple[str, str | None]] = {
    "quality.shape_min": ("shape", "quads"),
    "quality.scaled_jacobian_min": ("scaled_jacobian", "quads"),
    "quality.triangle_scaled_jacobian_min": ("scaled_jacobian", "triangles"),
    "quality.stretch_min": ("stretch", "quads"),
    "quality.min_angle": ("min_angle", None),
    "quality.mean_ratio_min": ("mean_ratio", None),
    "quality.radius_ratio_min": ("radius_ratio", None),
    "quality.warpage_max": ("warpage", "quads"),
    "quality.aspect_ratio_max": ("aspect_ratio", "quads"),
    "quality.triangle_aspect_ratio_max": ("aspect_ratio", "triangles"),
    "quality.skew_max": ("skew", "quads"),
    "quality.taper_max": ("taper", "quads"),
    "quality.max_angle": ("max_angle", None),
}
"""Figures that are the least or largest of a measure of faces: its name, and of which faces; None of all."""


def kind_of(figure: str) -> str | None:
    """Return which faces a figure is about, quads or triangles; None if it is about all or about no face."""
    return _OF_A_FACE[figure][1] if figure in _OF_A_FACE else None


def blamed_faces(mesh: Mesh, asked: str | Comparison) -> BoolArray | None:
    """Return the faces that a requirement which is not met is due to, (F,); None if none can be blamed.

    Args:
        mesh: The mesh.
        asked: A word or a comparison.
    """
    if isinstance(asked, str):
        masks = [_FINDERS[figure](mesh) for figure in WORDS[asked] if figure in _FINDERS]
        return np.logical_or.reduce(masks) if masks else None
    if asked.figure in _OF_A_FACE:
        return _beyond(mesh, asked)
    if asked.relation not in _LARGEST:
        return None
    if asked.figure == "topology.components":
        most = math.ceil(asked.limit) - 1 if asked.relation == "<" else math.floor(asked.limit)
        return np.asarray(~mask_of_largest(mesh, max(most, 0)))
    return _FINDERS[asked.figure](mesh) if asked.figure in _FINDERS else None


def _beyond(mesh: Mesh, asked: Comparison) -> BoolArray | None:
    """Return the faces whose own measure is not as the figure has to be."""
    wanted = _LARGEST if asked.figure.endswith(("_max", ".max_angle")) else _LEAST
    if asked.relation not in wanted:
        return None
    name, kind = _OF_A_FACE[asked.figure]
    values = list_elements(mesh)[name].reshape(mesh.face_count, -1)
    with np.errstate(invalid="ignore"):
        beyond = (~asked.compare(values, asked.limit) & ~np.isnan(values)).any(axis=1)
    if kind is None:
        return np.asarray(beyond)
    return np.asarray(beyond & (_triangles(mesh) == (kind == "triangles")))


def _triangles(mesh: Mesh) -> BoolArray:
    return np.asarray(_rows(mesh)[:, 3] < 0)


def _rows(mesh: Mesh) -> Any:
    return mesh.faces.numpy().reshape(-1, 4)


def _on_boundary(mesh: Mesh) -> BoolArray:
    """Return the faces with a side that no other face has."""
    twins = connect(mesh).require_halfedges().twin.numpy().reshape(-1, 4)
    return np.asarray(((twins < 0) & (_rows(mesh) >= 0)).any(axis=1))


def _intersecting(mesh: Mesh) -> BoolArray:
    found = np.zeros(mesh.face_count, bool)
    found[find_intersections(mesh).ravel()] = True
    return found


def _at_crowded_edges(mesh: Mesh) -> BoolArray:
    """Return the faces at vertex pairs that more than two faces have, or two that run them the same way."""
    tails = _rows(mesh).astype(np.int64)
    heads = np.roll(tails, -1, axis=1)
    is_triangle = tails[:, 3] < 0
    heads[is_triangle, 2] = tails[is_triangle, 0]
    is_edge = (tails >= 0) & (tails != heads)
    a, b = tails[is_edge], heads[is_edge]
    crowded = _uses(np.minimum(a, b), np.maximum(a, b)) > 2
    found = np.zeros(tails.shape, bool)
    found[is_edge] = crowded | (_uses(a, b) > 1)
    return np.asarray(found.any(axis=1))


def _uses(a: Any, b: Any) -> Any:
    """Return how often each pair of vertices is there."""
    _, which, counts = np.unique(a << 32 | b, return_inverse=True, return_counts=True)
    return counts[which]


def _at_split_vertices(mesh: Mesh) -> BoolArray:
    """Return the faces at vertices round which faces form several fans."""
    rows, splits = _rows(mesh), inspect_vertices(mesh).splits
    return np.asarray(((splits[rows] > 0) & (rows >= 0)).any(axis=1))


_FINDERS: dict[str, Callable[[Mesh], BoolArray]] = {
    "mesh.triangles": _triangles,
    "topology.boundary_edges": _on_boundary,
    "topology.boundary_loops": _on_boundary,
    "topology.non_manifold_edges": _at_crowded_edges,
    "topology.misoriented_edges": _at_crowded_edges,
    "topology.non_manifold_vertices": _at_split_vertices,
    "quality.self_intersections": _intersecting,
}
"""Figures that count what faces have to do with, and how these are found."""
