"""A mesh through the stages, and as plain arrays for the oracle."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.contouring import Surface, color_faces, connect_faces
from dmc_cli.mesh.connectivity import connect
from dmc_cli.mesh.mesh import COLOR, Mesh
from dmc_cli.mesh.placement import Placement
from dmc_cli.processing.patterns import Simplified, simplify
from dmc_cli.processing.relaxation import relax
from dmc_cli.runtime.device import Device
from dmc_cli.settings import MeshSettings
from tests.oracle.simplify import (
    ColoredMesh,
    chosen_by_color,
    chosen_by_counter,
    outer_sides,
    pattern_3x3y,
    pattern_3333,
    remove_3x3y,
    remove_3333,
)


def on_device(shape, device: Device, twin: Any = None) -> Mesh:
    """A shape of `shapes` as a mesh, its twins those given, else not yet found."""
    points, faces = shape
    mesh = Mesh(
        wp.array(np.asarray(points, np.float32), dtype=wp.vec3f, device=device.name),
        wp.array(np.asarray(faces, np.int32), dtype=wp.vec4i, device=device.name),
        device,
        triangle_count=int((np.asarray(faces)[:, 3] < 0).sum()) if len(faces) else 0,
    )
    if twin is None:
        return mesh
    halfedges = connect(mesh).halfedges
    given = wp.array(np.asarray(twin, np.int32), dtype=wp.int32, device=device.name)
    return replace(mesh, halfedges=replace(halfedges, twin=given))


def for_oracle(surface: Surface) -> ColoredMesh:
    """Copies of the arrays of a coloured surface, positions in double precision."""
    mesh = surface.mesh
    return ColoredMesh(
        mesh.positions.numpy().astype(np.float64),
        mesh.faces.numpy().astype(np.int64),
        mesh.halfedges.twin.numpy().astype(np.int64),
        mesh.face_values[COLOR].numpy().copy(),
    )


def simplified(surface: Surface, **settings: Any) -> Simplified:
    """The result of simplification; the surface's arrays are of no use afterwards."""
    return simplify(surface.mesh, surface.placement, MeshSettings(**{"simplify": "all", **settings}))


def colored(surface: Surface) -> Surface:
    """A surface with its halfedges and colours."""
    return color_faces(connect_faces(surface))


@dataclass(frozen=True)
class Placed:
    """A mesh and where its vertices lie, as surfaces and results have both."""

    mesh: Mesh
    placement: Placement


def relaxed(surface: Any, steps: int, **settings: Any) -> Placed:
    """What relaxation makes of a surface or a result."""
    return Placed(*relax(surface.mesh, surface.placement, steps, **settings))


def vertex_pair_uses(quads: np.ndarray) -> np.ndarray:
    """How many quads have each vertex pair that is a side of one."""
    sides = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return np.unique(sides, axis=0, return_counts=True)[1]


def euler_and_components(quads: np.ndarray, twin: np.ndarray) -> tuple[int, int]:
    """V - E + F with edges as twin pairs or boundary halfedges, and the sets of quads joined by twins."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(quads)
    with_twin = np.flatnonzero(twin >= 0)
    edges = len(with_twin) // 2 + int((twin < 0).sum())
    if not count:
        return 0, 0
    links = coo_array((np.ones(len(with_twin)), (with_twin // 4, twin[with_twin] // 4)), shape=(count, count))
    return len(np.unique(quads)) - edges + count, connected_components(links, directed=False)[0]


def quad_normals(positions: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """The cross product of each quad's diagonals."""
    corner = positions[quads]
    return np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])


@dataclass(frozen=True)
class OracleResult:
    """What the oracle leaves, and the numbers that its quads and vertices had at the beginning."""

    mesh: ColoredMesh
    removed: tuple[int, int, int]
    quad_numbers: np.ndarray
    vertex_numbers: np.ndarray

    def with_gaps_filled(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Quads, twins and positions as the kernels number them: the last ones move into the gaps."""
        quad_order, vertex_order = filled(self.quad_numbers), filled(self.vertex_numbers)
        quad_place, vertex_place = np.argsort(quad_order), np.argsort(vertex_order)
        quads = vertex_place[self.mesh.quads][quad_order]
        twins = self.mesh.twins.reshape(-1, 4)[quad_order].ravel()
        twins = np.where(twins < 0, -1, 4 * quad_place[twins // 4] + twins % 4)
        return quads, twins, self.mesh.positions[vertex_order]


def filled(numbers: np.ndarray) -> np.ndarray:
    """For each new number the index in `numbers` (ascending, with gaps) of the item that gets it."""
    count = len(numbers)
    order = np.empty(count, dtype=np.int64)
    stays = numbers < count
    order[numbers[stays]] = np.flatnonzero(stays)
    gaps = np.setdiff1d(np.arange(count), numbers[stays])
    order[gaps] = np.flatnonzero(~stays)
    return order


def simplified_by_oracle(mesh: ColoredMesh) -> OracleResult:
    """The oracle's three passes, with the numbers that are left after each."""
    quad_numbers, vertex_numbers = np.arange(len(mesh.quads)), np.arange(mesh.vertex_count)
    removed = []
    for choose in (chosen_by_color, chosen_by_counter):
        chosen, corner = choose(mesh), pattern_3x3y(mesh)
        gone = [int(mesh.quads[q, [corner[q], corner[q] + 2]].max()) for q in chosen]
        quad_numbers, vertex_numbers = np.delete(quad_numbers, chosen), np.delete(vertex_numbers, gone)
        mesh = remove_3x3y(mesh, chosen)
        removed.append(len(chosen))
    chosen = pattern_3333(mesh)
    gone_quads = sorted({side // 4 for q in chosen for side in outer_sides(mesh, q)})
    gone = np.unique(mesh.quads[chosen])
    quad_numbers, vertex_numbers = np.delete(quad_numbers, gone_quads), np.delete(vertex_numbers, gone)
    mesh = remove_3333(mesh, chosen)
    return OracleResult(mesh, (*removed, len(gone_quads)), quad_numbers, vertex_numbers)
