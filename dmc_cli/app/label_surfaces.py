"""Make the surfaces of one label map: the conforming net, smoothed, and the shells that are taken from it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import AnyArray, Float32Array, Float64Array, Int32Array, IntArray
from dmc_cli.contouring import LabelNet, NetSmoother, Shells, extract_net, extract_shells
from dmc_cli.field import grid_affine, grid_of, is_mirrored, kernel_matrix, map_vertices, slice_depths
from dmc_cli.measures import find_intersections
from dmc_cli.mesh import Mesh, vertex_normals
from dmc_cli.progress import Stopwatch
from dmc_cli.runtime import Device, adopt
from dmc_cli.volume import Volume, encode_labels

HALF_ROUNDS, MOST_ROUNDS = 1, 24
"""Rounds in which vertices of quads that intersect go half way back, and rounds at most; then they go all the
way: where they begin, no two quads intersect."""


@dataclass(frozen=True)
class LabelMesh:
    """The conforming mesh of a label map, in the output space, and the shells in it.

    Attributes:
        points: float32 (V, 3).
        faces: int32 (Q, 4); normals point from the first label of `sides` to the second.
        sides: Codes of the labels on both sides, the larger first, int32 (Q, 2).
        shell_vertices: The vertex of `points` that each vertex of a shell lies at, int32 (S,).
        shell_vertex_codes: Its label's code, int32 (S,).
        shell_faces: Vertices of shells, int32 (F, 4), normals outwards.
        shell_face_codes: Their labels' codes, int32 (F,).
        intersections: Pairs of quads that intersect.
    """

    points: Float32Array
    faces: Int32Array
    sides: Int32Array
    shell_vertices: Int32Array
    shell_vertex_codes: Int32Array
    shell_faces: Int32Array
    shell_face_codes: Int32Array
    intersections: int


@dataclass(frozen=True)
class Shell:
    """The closed shell of a label: points, float32 (V, 3), and quads, int32 (Q, 4), seen from outside."""

    points: Float32Array
    faces: Int32Array


def make_label_mesh(
    volume: Volume,
    stored: AnyArray,
    affine: Float64Array,
    device: Device,
    watch: Stopwatch,
    *,
    even_slices: bool = False,
    reserve: Callable[[int], None] | None = None,
) -> LabelMesh:
    """Return the smooth conforming mesh of some labels of a label map, and their shells.

    Args:
        volume: A label map.
        stored: Stored values of the labels; the code of the first is 1.
        affine: Shape (4, 4): node index to the output space.
        device: Where to work.
        watch: Who times the stages.
        even_slices: Leave slice positions aside, as grid coordinates do.
        reserve: Called with the number of quads before memory for them is taken; it may raise.
    """
    with watch.stage("surface", "extracting the surfaces"):
        grid = grid_of(volume.shape, 1)
        codes = _on_device(encode_labels(volume, stored), device)
        net = extract_net(codes, grid, device, reserve)
        del codes
    with watch.stage("smooth", "smoothing"):
        smoother = NetSmoother(net, volume.spacing)
        owes = smoother.run(watch.progress)
    matrix = kernel_matrix(grid_affine(affine, grid))
    depths = slice_depths(None if even_slices else volume, grid, device)

    def positions() -> Any:
        return map_vertices(smoother.cells, smoother.local, depths, grid, matrix, device)

    with watch.stage("repair", "taking back intersections"):
        points, left = _without_flaws(net, smoother, positions, owes=owes)
    with watch.stage("shells", "taking the shells"):
        shells = extract_shells(net)
    return _on_host(net, shells, points, left, reverse=is_mirrored(affine))


def _on_device(codes: AnyArray, device: Device) -> Any:
    """Return codes on a device, on CPU without a copy."""
    if device.is_cpu:
        return adopt(codes, wp.uint16)
    return wp.array(codes, dtype=wp.uint16, device=device.name)


def list_shells(mesh: LabelMesh, count: int) -> Iterator[Shell]:
    """Yield the shells of the labels with the codes 1 to `count`, in this order."""
    vertex_order, vertex_starts = _by_code(mesh.shell_vertex_codes, count)
    face_order, face_starts = _by_code(mesh.shell_face_codes, count)
    numbers = np.zeros(len(mesh.shell_vertices), np.int32)
    for n in range(count):
        vertices = vertex_order[vertex_starts[n] : vertex_starts[n + 1]]
        numbers[vertices] = np.arange(len(vertices), dtype=np.int32)
        faces = mesh.shell_faces[face_order[face_starts[n] : face_starts[n + 1]]]
        yield Shell(mesh.points[mesh.shell_vertices[vertices]], numbers[faces])


def _by_code(codes: Int32Array, count: int) -> tuple[IntArray, IntArray]:
    """Return the order of items by their codes, 1 to `count`, and where each code begins in it."""
    order = np.argsort(codes, kind="stable")
    return order, np.searchsorted(codes[order], np.arange(1, count + 2))


def patch_volumes(points: AnyArray, faces: Int32Array) -> Float64Array:
    """Return the volume between each quad, as the bilinear patch, and the middle of all points, float64 (Q,).

    The sum over a closed shell is the volume that it encloses.
    """
    middle = points.mean(axis=0, dtype=np.float64) if len(points) else np.zeros(3)
    corner = points.astype(np.float64)[faces] - middle
    a, b, c, d = (corner[:, n] for n in range(4))
    # a patch lies half way between the two ways to split its quad: four tetrahedra, each by half
    products = np.einsum("qi,qi->q", np.cross(a, b), c + d) + np.einsum("qi,qi->q", np.cross(c, d), a + b)
    volumes: Float64Array = products / 12.0
    return volumes


def corner_normals(shell: Shell) -> Float32Array:
    """Return unit normals of a shell's vertices, float32 (V, 3): the sums of their quads' vectors of area."""
    unit = vertex_normals(shell.points, shell.faces)
    unit[~unit.any(axis=1)] = (0.0, 0.0, 1.0)
    normals: Float32Array = unit.astype(np.float32)
    return normals


def _without_flaws(
    net: LabelNet, smoother: NetSmoother, positions: Callable[[], Any], *, owes: bool
) -> tuple[Any, int]:
    """Move vertices of quads that intersect back; return positions, and how many pairs still intersect.

    What that takes from labels is given back where no quad intersects or folds again, as is what was owed
    before, if `owes` says so.
    """

    def flawed() -> tuple[Any, int, IntArray]:
        points = positions()
        pairs: IntArray = find_intersections(Mesh(points, net.faces, net.device))
        folds = smoother.folded() if len(pairs) or retreated else np.zeros(0, np.int64)
        return points, len(pairs), np.union1d(pairs, folds)

    retreated = 0
    points, left, quads = flawed()
    while len(quads) and retreated < MOST_ROUNDS:
        smoother.retreat(quads, 0.5 if retreated < HALF_ROUNDS else 1.0)
        retreated += 1
        points, left, quads = flawed()
    if (owes or retreated) and not len(quads):
        safe, before = wp.clone(smoother.local), points
        smoother.give_back()
        retreated += 1  # from here on folds count
        points, left, quads = flawed()
        for _ in range(MOST_ROUNDS):
            if not len(quads):
                return points, 0
            smoother.retreat(quads, refuge=safe)
            points, left, quads = flawed()
        wp.copy(smoother.local, safe)
        return before, 0
    return points, left


def _on_host(net: LabelNet, shells: Shells, points: Any, left: int, *, reverse: bool) -> LabelMesh:
    """Return the mesh on the host, quads turned round where the map to the output space mirrors."""
    faces, shell_faces = net.faces.numpy(), shells.faces.numpy()
    if reverse:
        faces, shell_faces = faces[:, [0, 3, 2, 1]], shell_faces[:, [0, 3, 2, 1]]
    return LabelMesh(
        points=points.numpy(),
        faces=np.ascontiguousarray(faces),
        sides=net.sides.numpy(),
        shell_vertices=shells.vertices.numpy(),
        shell_vertex_codes=shells.vertex_codes.numpy(),
        shell_faces=np.ascontiguousarray(shell_faces),
        shell_face_codes=shells.face_codes.numpy(),
        intersections=left,
    )
