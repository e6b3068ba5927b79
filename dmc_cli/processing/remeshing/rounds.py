"""Reduce irregular vertices by local edge rotations, quad collapses and splits (`--remesh`).

A round shifts the blocks, sweeps over them (`sweep.py`), closes the gaps and smooths; at last high and
bad quads are mended (`mend.py`). Every operation is judged as it is done, so after every round the mesh
is as manifold, as unfolded and as near to the surface and to the old vertices (`distance_guard.py`) as
before it. The temperature falls to 0; a quad that goes costs more the fewer there are.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.contouring.dual_marching_cubes.coloring import repair_colors
from dmc_cli.mesh.halfedges import Halfedges, flat_quads
from dmc_cli.mesh.surface import Surface
from dmc_cli.processing.distance_guard import list_points, track_vertices, with_nearer_quads
from dmc_cli.processing.relaxation.relax import measure_shapes, relax
from dmc_cli.processing.remeshing.blocks import Blocks, find_normals, freeze_fans, make_blocks, with_spares
from dmc_cli.processing.remeshing.mend import MEND_PASSES, Limits, mark_high, mend_kernel
from dmc_cli.processing.remeshing.mesh import Mesh, with_room, without_gaps
from dmc_cli.processing.remeshing.sweep import HEIGHT_LIMIT, PASSES, Rules, sweep_kernel
from dmc_cli.processing.remeshing.work import CHANGES, CORE, JOURNAL, LINKS, PATCH, TALLIES, TRACKED, Work
from dmc_cli.processing.tangent_step import make_context
from dmc_cli.progress import SILENT, Progress
from dmc_cli.runtime.device import Device

TEMPERATURE = 0.05
"""At the first round; a high one makes pairs of irregular vertices that it does not remove again."""

COLD_SHARE = 0.1
"""Of the rounds, the last ones, at temperature 0."""

TRIES = 8
"""Operations tried at an irregular vertex each time that its block comes to it."""

LEAST_SHARE, PRICE_SLOPE = 0.97, 20.0
"""Share of the quads below which a quad that goes has a price, and how that rises with the share lost."""

RELAXED_FIRST, RELAXED_LAST, RELAX_EVERY = 3, 15, 3
"""Steps of smoothing before the rounds and after them, and rounds after which there is one step."""


MENDINGS, BAD_SHARE = 3, 0.002
"""Times that the worst quads are mended at the end, each time in other blocks, and which share of them."""

MOST_MENDINGS = 8
"""Times at most: those after the first few are only for quads that are still high."""

VISITS = 4096
"""Of a block's vertices in one launch at most, which is a tenth of a second where all are irregular."""


@dataclass(frozen=True)
class Improved:
    """A mesh after the rounds, and how many operations were done."""

    surface: Surface
    halfedges: Halfedges
    color: Any | None
    color24: Any | None
    operations: int


def remesh(
    surface: Surface,
    halfedges: Halfedges,
    rounds: int,
    color: Any | None = None,
    color24: Any | None = None,
    progress: Progress = SILENT,
) -> Improved:
    """Return the mesh after `rounds` rounds; no array is changed.

    Args:
        surface: The mesh after the papers' passes, and what it was made from.
        halfedges: Its halfedges.
        rounds: How many.
        color: Colours 0 to 4, uint8 (Q,), or None; kept proper.
        color24: The grid's colours, uint8 (Q,), or None; new quads have 0.
        progress: Told the share of the rounds that are done.
    """
    return Rounds(surface, halfedges, color, color24).run(rounds, progress)


class Rounds:
    """A mesh on its way through the rounds, which lets go of every array as soon as the next one is there.

    So a caller that drops the surface and the halfedges before `run` has their memory back in it.
    """

    def __init__(
        self, surface: Surface, halfedges: Halfedges, color: Any | None = None, color24: Any | None = None
    ) -> None:
        """Take a mesh; the arguments are those of `remesh`."""
        device = surface.device
        self._has_color = color is not None
        colors = tuple(c for c in (color, color24) if c is not None)
        frozen = device.zeros(surface.vertices.shape[0], wp.uint8)
        self._mesh = _mesh_of(surface, halfedges, colors, frozen, device)
        freeze_fans(self._mesh, device)
        cell, local = self._mesh.cell, self._mesh.local
        self._tracked = track_vertices(surface.grid, self._mesh.vertex_halfedge, cell, local, device)
        nothing = {"vertices": None, "vertex_cell": None, "vertex_local": None, "quads": None}
        self._origin = replace(surface, quad_starts=None, **nothing)
        self._context = make_context(surface)
        self._device = device

    def run(self, rounds: int, progress: Progress = SILENT) -> Improved:
        """Return the mesh after `rounds` rounds; once only."""
        first_quads, operations = self._mesh.quad_count, 0
        self._relax(RELAXED_FIRST)
        for turn in range(rounds):
            progress.advance(turn / rounds)
            operations += self._sweep(_rules(turn, rounds, self._mesh.quad_count / max(first_quads, 1)))
            if (turn + 1) % RELAX_EVERY == 0 or turn + 1 == rounds:
                self._relax(1 if turn + 1 < rounds else RELAXED_LAST)
        for turn in range(MOST_MENDINGS):
            high = mark_high(self._mesh, self._context, self._device)
            if turn >= MENDINGS and self._device.total(high) == 0:
                break
            self._mend(high, turn)
        return self._result(operations)

    def _result(self, operations: int) -> Improved:
        """Return what the rounds have made."""
        mesh, device = self._mesh, self._device
        kept = list(mesh.colors)
        color = kept.pop(0) if self._has_color else None
        if color is not None:
            seams = wp.array(np.arange(4 * mesh.quad_count, dtype=np.int32), device=device.name)
            repair_colors(device, mesh.twin, color, seams)
        surface, halfedges = _surface_of(mesh, self._origin), _halfedges_of(mesh, device)
        return Improved(surface, halfedges, color, kept[0] if kept else None, operations)

    def _relax(self, steps: int) -> None:
        """Take some steps of smoothing."""
        surface, halfedges = _surface_of(self._mesh, self._origin), _halfedges_of(self._mesh, self._device)
        found = relax(surface, halfedges, steps, tracked=self._tracked)
        self._mesh = replace(
            self._mesh, position=found.vertices, cell=found.vertex_cell, local=found.vertex_local
        )

    def _sweep(self, rules: Any) -> int:
        """Sweep over the mesh once; return how many operations were done."""
        device, grid, mesh = self._device, self._origin.grid, self._mesh
        self._tracked = with_nearer_quads(self._tracked, grid, mesh, device)
        blocks = make_blocks(mesh, grid, rules.round, device)
        vertices, quads = mesh.vertex_count, mesh.quad_count
        del mesh
        self._mesh = with_room(self._mesh, blocks.spare, device)
        work = self._work(blocks, vertices)
        inputs = [self._context, rules, blocks.starts, blocks.items, blocks.spare_starts, vertices, quads]
        for visits in _portions(blocks, PASSES):
            device.launch(sweep_kernel, blocks.count, [*inputs, *visits], [work], grain=1, longest=1)
        done = int(work.tally.numpy()[:, CHANGES].sum())
        del work, blocks, inputs
        self._close_gaps()
        return done

    def _mend(self, high: Any, turn: int) -> None:
        """Mend the worst quads and those at vertices marked `high`."""
        device, mesh = self._device, self._mesh
        shape = measure_shapes(_surface_of(mesh, self._origin), _halfedges_of(mesh, device)).numpy()
        limits = Limits()
        limits.bad = float(np.quantile(shape, BAD_SHARE)) if len(shape) else 0.0
        limits.height, limits.may_fold = HEIGHT_LIMIT, int(turn >= MENDINGS)
        del shape
        blocks = make_blocks(mesh, self._origin.grid, turn, device)
        vertices = mesh.vertex_count
        del mesh
        self._mesh = with_room(self._mesh, blocks.spare, device)
        work = self._work(blocks, vertices)
        inputs = [self._context, blocks.starts, blocks.items, high, limits]
        for visits in _portions(blocks, MEND_PASSES):
            device.launch(mend_kernel, blocks.count, [*inputs, *visits], [work], grain=1, longest=1)
        del work, blocks, inputs
        self._close_gaps()

    def _close_gaps(self) -> None:
        """Leave out what has gone."""
        self._mesh, nearest_quad = without_gaps(self._mesh, self._tracked.nearest_quad, self._device)
        self._tracked = replace(self._tracked, nearest_quad=nearest_quad)

    def _work(self, blocks: Blocks, vertices: int) -> Any:
        """Return the kernels' view of the mesh, which has room, of tracked points, and a bench a block."""
        work, mesh, tracked = Work(), self._mesh, self._tracked
        count, device = blocks.count, self._device
        work.normal, work.sense = find_normals(mesh, self._context, device), self._origin.sense
        work.tracked_point, work.nearest_quad = tracked.point, tracked.nearest_quad
        work.first_point, work.next_point = list_points(tracked, mesh.quad_count, device)
        work.corners, work.twin, work.quad_gone = mesh.corners, mesh.twin, mesh.quad_gone
        work.vertex_halfedge, work.valence = mesh.vertex_halfedge, mesh.valence
        work.vertex_gone = mesh.vertex_gone
        work.position, work.cell, work.local = mesh.position, mesh.cell, mesh.local
        work.vertex_block = with_spares(blocks, vertices, device)
        work.journal_place = device.empty((count, JOURNAL), wp.int64)
        work.journal_value = device.empty((count, JOURNAL), wp.int32)
        work.chain = device.empty((count, LINKS), wp.int32)
        work.listed, work.new_nearest = (device.empty((count, TRACKED), wp.int32) for _ in range(2))
        work.core_valence = device.empty((count, CORE), wp.int32)
        work.core = device.empty((count, CORE), wp.int32)
        work.core_cell = device.empty((count, CORE), wp.int64)
        work.core_position = device.empty((count, CORE), wp.vec3)
        work.core_local = device.empty((count, CORE), wp.vec3)
        work.core_normal = device.empty((count, CORE), wp.vec3)
        work.patch = device.empty((count, PATCH), wp.int32)
        work.tally = device.zeros((count, TALLIES), wp.int32)
        return work


def _rules(turn: int, rounds: int, share: float) -> Any:
    """Return what holds in a round when a share of the quads is left."""
    rules = Rules()
    rules.round, rules.tries = turn, TRIES
    rules.temperature = TEMPERATURE * max(0.0, 1.0 - turn / ((1.0 - COLD_SHARE) * rounds))
    rules.price = float(np.clip(PRICE_SLOPE * (LEAST_SHARE - share), 0.0, 2.0))
    return rules


def _portions(blocks: Blocks, passes: int) -> Iterator[tuple[int, int]]:
    """Yield portions of the visits of a block's vertices, `passes` each, as begin and end; at least one."""
    most = passes * int(np.diff(blocks.starts.numpy()).max(initial=0))
    for begin in range(0, max(most, 1), VISITS):
        yield begin, begin + VISITS


def _mesh_of(
    surface: Surface, halfedges: Halfedges, colors: tuple[Any, ...], frozen: Any, device: Device
) -> Mesh:
    """Return a surface and its halfedges as a mesh for the rounds."""
    return Mesh(
        flat_quads(surface.quads),
        halfedges.twin,
        colors,
        halfedges.vertex_halfedge,
        halfedges.valence,
        surface.vertices,
        surface.vertex_cell,
        surface.vertex_local,
        frozen,
        device.zeros(surface.quads.shape[0], wp.uint8),
        device.zeros(surface.vertices.shape[0], wp.uint8),
    )


def _surface_of(mesh: Mesh, surface: Surface) -> Surface:
    """Return the surface that a mesh without gaps has become."""
    return replace(
        surface,
        vertices=mesh.position,
        vertex_cell=mesh.cell,
        vertex_local=mesh.local,
        quads=_quads_of(mesh),
        quad_starts=None,
    )


def _halfedges_of(mesh: Mesh, device: Device) -> Halfedges:
    """Return the halfedges of a mesh without gaps."""
    defect = device.zeros(mesh.quad_count, wp.uint8)
    return Halfedges(_quads_of(mesh), mesh.twin, mesh.vertex_halfedge, mesh.valence, defect, None)


def _quads_of(mesh: Mesh) -> Any:
    """Return the corners as vec4i (Q,): the same memory, kept alive by the view."""
    flat = mesh.corners
    quads = wp.array(ptr=flat.ptr, dtype=wp.vec4i, shape=mesh.quad_count, device=flat.device, copy=False)
    quads._source = flat  # as long as the view lives
    return quads
