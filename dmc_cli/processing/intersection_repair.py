"""Undo self-intersections: the vertices of faces that intersect go towards the mean of their neighbours.

Faces that intersect are few and small: a fold where the surface is bent more than the grid shows, seldom two
sheets. Half a step towards the mean of the neighbours undoes most of them. The first rounds keep vertices on
the surface; where that is not enough, they leave it. Vertices of a boundary stay. In each round only vertices
of faces that intersect then move, all at once (Jacobi), and only faces that have moved are looked at again.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray, Float64Array, Int32Array
from dmc_cli.field import cell_node, index_position, node_cell, output_position, point_at, slice_distance
from dmc_cli.mesh import Mesh, Placement, in_frame_of, in_near_frame, require_mesh, require_places
from dmc_cli.processing.tangent_step import SurfaceContext, glide, make_context
from dmc_cli.runtime import ITEMS_A_CHUNK

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

MOST_ROUNDS = 20
"""Rounds at most; nearly all meshes need one or two."""

ROUNDS_ON_SURFACE = 3
"""Rounds in which vertices stay on the surface."""

FACES_AT_ONCE = 1 << 16
"""Faces whose corners are looked up at a time."""

SHARE = 0.5
"""Of the way to the mean of the neighbours."""


class Find(Protocol):
    """What finds pairs of faces that intersect."""

    def __call__(self, mesh: Mesh, faces: Int32Array | None = None) -> Int32Array:
        """Return the pairs of a mesh, (n, 2); with `faces` only those with one of them."""


@dataclass(frozen=True)
class Repaired:
    """A mesh after its intersections were undone.

    Attributes:
        mesh: Its vertices have moved; faces and their order are the same.
        placement: Where its vertices lie; None where there is no field.
        pairs_before: Pairs of faces that intersected.
        pairs_after: Those that still do.
        moved: Vertices that were moved.
        left_surface: Those of them that may have left the surface.
        rounds: How many there were.
    """

    mesh: Mesh
    placement: Placement | None
    pairs_before: int
    pairs_after: int
    moved: int
    left_surface: int
    rounds: int


def repair_intersections(mesh: Mesh, placement: Placement | None, find: Find) -> Repaired:
    """Return the mesh without intersections, as far as they can be undone; no array is changed.

    Args:
        mesh: The mesh.
        placement: Where its vertices lie on a field's surface; without it they are free.
        find: `find_intersections`.

    Raises:
        CallError: Mesh and placement do not belong together.
    """
    require_mesh(mesh)
    if placement is None:
        return _repaired(mesh, None, find)
    require_places(mesh, placement)
    near = _repaired(*in_near_frame(mesh, placement), find)  # what rounding alone has intersect stays
    assert near.placement is not None
    given = placement.frame.affine
    is_near = near.placement.frame.affine is given
    if near.moved:
        mesh, placement = in_frame_of(given, near.mesh, near.placement)
    after = near.pairs_after if is_near else len(find(mesh))
    return replace(near, mesh=mesh, placement=placement, pairs_after=after)


def _repaired(mesh: Mesh, placement: Placement | None, find: Find) -> Repaired:
    """Repair a mesh in its own frame, or leave it as it is where that undoes none."""
    pairs = find(mesh)
    before, rounds, given = len(pairs), 0, (mesh, placement)
    moved: set[int] = set()
    left: set[int] = set()
    if before:
        mesh = replace(mesh, positions=wp.clone(mesh.positions))
    if before and placement is not None:
        placement = replace(placement, cell=wp.clone(placement.cell), local=wp.clone(placement.local))
    while len(pairs) and rounds < MOST_ROUNDS:
        stays = placement is not None and rounds < ROUNDS_ON_SURFACE
        vertices = _pull(mesh, placement, pairs, stays_on_surface=stays)
        moved.update(vertices.tolist())
        left.update(() if stays else vertices.tolist())
        pairs, rounds = _pairs_after(mesh, vertices, pairs, find), rounds + 1
    if len(pairs) >= before:
        return Repaired(*given, before, before, 0, 0, rounds)
    return Repaired(mesh, placement, before, len(pairs), len(moved), len(left), rounds)


def _pairs_after(mesh: Mesh, moved: Int32Array, pairs: Int32Array, find: Find) -> Int32Array:
    """Return the pairs that intersect after some vertices moved, given those before."""
    has_moved = np.zeros(
        mesh.vertex_count + 1, bool
    )  # the last one stands for the corner that triangles lack
    has_moved[moved] = True
    is_changed = _faces_with(has_moved, mesh.faces.numpy())
    kept = pairs[~is_changed[pairs].any(axis=1)]
    return np.concatenate([kept, find(mesh, np.flatnonzero(is_changed).astype(np.int32))])


def _pull(
    mesh: Mesh, placement: Placement | None, pairs: Int32Array, *, stays_on_surface: bool
) -> Int32Array:
    """Move the vertices of faces that intersect by a step, in place; return which ones."""
    vertices, steps = _steps(mesh, pairs)
    device = mesh.device
    if placement is None:
        points = mesh.positions.numpy().copy()
        points[vertices] += steps.astype(np.float32)
        mesh.positions.assign(points)
        return vertices
    inputs = [
        make_context(placement.frame),
        wp.array(vertices, dtype=wp.int32, device=device.name),
        wp.array(steps.astype(np.float32), dtype=wp.vec3, device=device.name),
        int(stays_on_surface),
    ]
    outputs = [placement.cell, placement.local, mesh.positions]
    device.launch(pull_kernel, len(vertices), inputs, outputs, ITEMS_A_CHUNK)
    return vertices


def _steps(mesh: Mesh, pairs: Int32Array) -> tuple[Int32Array, Float64Array]:
    """Return the vertices of some faces, without those of a boundary, and their steps, (n, 3)."""
    faces, points = mesh.faces.numpy(), mesh.positions.numpy()
    corners = faces[np.unique(pairs)]
    chosen = np.zeros(len(points) + 1, bool)  # the last one stands for the corner that triangles lack
    chosen[corners.ravel()] = True
    chosen[-1] = False
    near = faces[_faces_with(chosen, faces)]
    following = np.roll(near, -1, axis=1)
    is_triangle = near[:, 3] < 0
    following[is_triangle, 2] = near[is_triangle, 0]
    sides = np.stack([near, following], axis=-1).reshape(-1, 2)
    sides = sides[(sides >= 0).all(axis=1)]
    edges, counts = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    chosen[edges[counts == 1].ravel()] = False
    vertices = np.flatnonzero(chosen).astype(np.int32)
    number = np.full(len(points), -1, np.int32)
    number[vertices] = np.arange(len(vertices), dtype=np.int32)
    sums, valence = np.zeros((len(vertices), 3)), np.zeros(len(vertices))
    for here, there in ((edges[:, 0], edges[:, 1]), (edges[:, 1], edges[:, 0])):
        moves = number[here] >= 0
        np.add.at(sums, number[here[moves]], points[there[moves]])
        np.add.at(valence, number[here[moves]], 1.0)
    return vertices, SHARE * (sums / valence[:, None] - points[vertices])


def _faces_with(chosen: BoolArray, faces: Int32Array) -> BoolArray:
    """Return which faces have a chosen corner; in pieces, since indices are widened."""
    found = np.empty(len(faces), bool)
    for first in range(0, len(faces), FACES_AT_ONCE):
        part = slice(first, first + FACES_AT_ONCE)
        found[part] = chosen[faces[part]].any(axis=1)
    return found


@wp.kernel
def pull_kernel(
    first: wp.int32,
    # In:
    context: SurfaceContext,
    vertices: wp.array(dtype=wp.int32),
    steps: wp.array(dtype=wp.vec3),
    stays_on_surface: wp.int32,
    # In/out:
    cell_inout: wp.array(dtype=wp.int64),
    local_inout: wp.array(dtype=wp.vec3),
    position_inout: wp.array(dtype=wp.vec3),
) -> None:
    """Move a vertex by its step, along the surface or off it. One thread per vertex that moves."""
    n = first + wp.tid()
    v = vertices[n]
    cell = cell_inout[v]
    local = local_inout[v]
    end = glide(context, cell, local, steps[n])
    if stays_on_surface == 0:
        way = context.to_grid * steps[n]
        way[2] = way[2] / wp.float32(slice_distance(context.depths, cell_node(context.grid, cell)[2]))
        end = point_at(context.grid, index_position(context.grid, cell, local) + wp.vec3d(way))
        end.local = wp.max(wp.min(end.local, wp.vec3(1.0, 1.0, 1.0)), wp.vec3(0.0, 0.0, 0.0))
        end.is_found = True
    if end.is_found:
        cell_inout[v] = node_cell(context.grid, end.cell)
        local_inout[v] = end.local
        position_inout[v] = output_position(context.to_output, context.depths, end.cell, end.local)
