"""List the connected components of a mesh, largest first: faces, area, volume, bounds."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import AnyArray, BoolArray, FloatArray, IntArray
from dmc_cli.measures.components import label_components, list_boundary
from dmc_cli.measures.quality import point_at
from dmc_cli.measures.shape import blank_shape, quad_shape, triangle_shape
from dmc_cli.mesh import Mesh, connect

wp.set_module_options({"enable_backward": False})

MOST = 1000
"""Components that a report lists."""

FACES_AT_ONCE = 1 << 15
"""Faces whose areas, volumes and bounds are there at a time."""


@dataclass(frozen=True, kw_only=True)
class Component:
    """A set of faces that are connected through twins.

    Attributes:
        faces: How many there are.
        area: Of all faces, in the unit of the coordinates squared.
        volume: What the faces enclose, positive if they look outward; None if the component has a boundary.
        bounds: Least and largest coordinates, ((x, y, z), (x, y, z)).
    """

    faces: int
    area: float
    volume: float | None
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]


def list_components(mesh: Mesh, most: int = MOST) -> list[Component]:
    """Return the components with most faces, at most so many; of equal ones the one that begins first.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    mesh = connect(mesh)
    twins = mesh.require_halfedges().twin
    labels = _whole(label_components(mesh.device, twins).numpy())
    roots = _roots(labels)
    counts = np.zeros(len(roots), np.int64)
    for start in range(0, len(labels), FACES_AT_ONCE):
        which = np.searchsorted(roots, labels[start : start + FACES_AT_ONCE])
        counts += np.bincount(which, minlength=len(roots))
    order = np.argsort(-counts, kind="stable")[:most]
    boundary = list_boundary(mesh.device, mesh.corners, twins).numpy()
    is_open = np.isin(roots[order], labels[boundary >> 2])
    # the components that are listed, by their roots
    listed = np.sort(order)
    areas, volumes, lows, highs = _sums(mesh, labels, roots[listed])
    found = []
    for component, has_boundary in zip(order.tolist(), is_open.tolist(), strict=True):
        n = int(np.searchsorted(listed, component))
        bounds = (tuple(lows[n].tolist()), tuple(highs[n].tolist()))
        found.append(
            Component(
                faces=int(counts[component]),
                area=float(areas[n]),
                volume=None if has_boundary else float(volumes[n]),
                bounds=bounds,
            )
        )
    return found


def mask_of_largest(mesh: Mesh, most: int | None = None, least: int = 0) -> BoolArray:
    """Return which faces belong to the components with most faces, (F,).

    Args:
        mesh: The mesh.
        most: How many components, of equal ones those that begin first; None for all.
        least: The fewest faces of a component.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    mesh = connect(mesh)
    labels = _whole(label_components(mesh.device, mesh.require_halfedges().twin).numpy())
    _, which, counts = np.unique(labels, return_inverse=True, return_counts=True)
    is_kept = counts >= least
    if most is not None:
        is_kept[np.argsort(-counts, kind="stable")[most:]] = False
    return np.asarray(is_kept[which])


def _whole(labels: IntArray) -> IntArray:
    """Return for each face the root above it, from what points to it over some faces."""
    while True:
        above = labels[labels]
        if np.array_equal(above, labels):
            return labels
        labels = above


def _roots(labels: IntArray) -> IntArray:
    """Return the faces that are their own label, ascending."""
    parts = [
        start + np.flatnonzero(part == np.arange(start, start + len(part), dtype=labels.dtype))
        for start, part in _parts(labels)
    ]
    return np.concatenate(parts) if parts else np.zeros(0, np.int64)


def _parts(labels: AnyArray) -> Iterator[tuple[int, Any]]:
    """Return the first item of each piece of an array, and the piece."""
    for start in range(0, len(labels), FACES_AT_ONCE):
        yield start, labels[start : start + FACES_AT_ONCE]


def _sums(mesh: Mesh, labels: IntArray, roots: IntArray) -> tuple[Any, Any, FloatArray, FloatArray]:
    """Return area, signed volume, least and largest coordinates of the components with these roots."""
    count, points = len(roots), mesh.positions.numpy()
    areas, volumes = np.zeros(count), np.zeros(count)
    lows, highs = np.full((3, count), np.inf, np.float32), np.full((3, count), -np.inf, np.float32)
    corners = mesh.faces.numpy()
    origin = wp.vec3d(*points[corners[0, 0]].astype(float).tolist()) if count else wp.vec3d()
    for start, part in _parts(labels):
        extents = mesh.device.empty((len(part), 2), wp.float64)
        inputs = [mesh.positions, mesh.corners, origin, start]
        mesh.device.launch(measure_extents_kernel, len(part), inputs, [extents])
        which = np.minimum(np.searchsorted(roots, part), count - 1)
        is_listed = roots[which] == part
        chosen: Any = slice(None) if is_listed.all() else np.flatnonzero(is_listed)
        which = which[chosen]
        if len(which) == 0:
            continue
        # neighbours in the order of the grid mostly belong together
        firsts = np.flatnonzero(np.diff(which, prepend=-1))
        of_runs = which[firsts]
        measured = np.add.reduceat(extents.numpy()[chosen], firsts)
        areas += np.bincount(of_runs, weights=measured[:, 0], minlength=count)
        volumes += np.bincount(of_runs, weights=measured[:, 1], minlength=count)
        a, b, c, d = corners[start : start + FACES_AT_ONCE][chosen].T
        d = np.where(d < 0, a, d)  # a triangle has its first corner twice
        for axis in range(3):
            along = [points[corner, axis] for corner in (a, b, c, d)]
            low, high = reduce(np.minimum, along), reduce(np.maximum, along)
            np.minimum.at(lows[axis], of_runs, np.minimum.reduceat(low, firsts))
            np.maximum.at(highs[axis], of_runs, np.maximum.reduceat(high, firsts))
    return areas, volumes, lows.T, highs.T


@wp.kernel
def measure_extents_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    origin: wp.vec3d,
    start: wp.int32,
    # Out:
    extents_out: wp.array2d[wp.float64],
) -> None:
    """Measure area and signed volume of a face, the volume seen from `origin`. One thread per face."""
    n = first + wp.tid()
    face = start + n
    a = point_at(points, corners[4 * face], origin)
    b = point_at(points, corners[4 * face + 1], origin)
    c = point_at(points, corners[4 * face + 2], origin)
    shape = blank_shape()
    if corners[4 * face + 3] < 0:
        shape = triangle_shape(a, b, c)
    else:
        shape = quad_shape(a, b, c, point_at(points, corners[4 * face + 3], origin))
    extents_out[n, 0] = shape.area
    extents_out[n, 1] = shape.volume
