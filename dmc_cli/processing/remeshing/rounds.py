"""Reduce irregular vertices by local edge rotations, quad collapses and splits (`--remesh`).

A round shifts the regions, sweeps over them (`sweep.py`), closes the gaps and smooths; at last high and
bad quads are mended (`mend.py`). Every operation is judged as it is done, so after every round the mesh
is as manifold, as unfolded and as near to the surface and to the old vertices (`distance_guard.py`) as
before it, and has no more warped quads than at first (`warp_accounts.py`). The temperature falls to 0; a quad
that goes costs more the fewer there are.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.mesh import (
    COLOR,
    DEFECT,
    Mesh,
    Placement,
    connect,
    in_frame_of,
    in_near_frame,
    pack,
    require_places,
    require_quads,
    with_room,
    working_mesh,
)
from dmc_cli.processing.color_repair import repair_colors
from dmc_cli.processing.distance_guard import renumbered, track_vertices, with_nearer_quads
from dmc_cli.processing.relaxation import measure_shapes, relax
from dmc_cli.processing.remeshing.bench import make_work, portions
from dmc_cli.processing.remeshing.inheritance import inherit_values
from dmc_cli.processing.remeshing.mend import MEND_PASSES, Limits, flag_high, mend_kernel
from dmc_cli.processing.remeshing.regions import FROZEN, Regions, frozen_vertices, make_regions
from dmc_cli.processing.remeshing.sweep import HEIGHT_LIMIT, PASSES, Rules, sweep_kernel
from dmc_cli.processing.remeshing.warp_accounts import measure_warp, open_accounts
from dmc_cli.processing.remeshing.work import CHANGES
from dmc_cli.processing.tangent_step import make_context
from dmc_cli.progress import SILENT, Progress

TEMPERATURE = 0.05
"""At the first round; a high one makes pairs of irregular vertices that it does not remove again."""

COLD_SHARE = 0.1
"""Of the rounds, the last ones, at temperature 0."""

TRIES = 8
"""Operations tried at an irregular vertex each time that its region comes to it."""

LEAST_SHARE, PRICE_SLOPE = 0.97, 20.0
"""Share of the quads below which a quad that goes has a price, and how that rises with the share lost."""

FIRST_WARP_PRICE, LAST_WARP_PRICE = 16.0, 3.0
"""What the first and the last round charge for a quad's warp beyond 30 degrees, for a cosine lower by 1."""

RELAXED_FIRST, RELAXED_LAST, RELAX_EVERY = 3, 15, 3
"""Steps of smoothing before the rounds and after them, and rounds after which there is one step."""


MENDINGS, BAD_SHARE = 3, 0.002
"""Times that the worst quads are mended at the end, each time in other regions, and which share of them."""

MOST_MENDINGS = 8
"""Times at most: those after the first few are only for quads that are still high."""


@dataclass(frozen=True)
class Remeshed:
    """A mesh after the rounds, where its vertices lie, and how many operations were done."""

    mesh: Mesh
    placement: Placement
    operations: int


def remesh(mesh: Mesh, placement: Placement, rounds: int, progress: Progress = SILENT) -> Remeshed:
    """Return the mesh after `rounds` rounds; no array is changed.

    Args:
        mesh: A mesh of quads. Colours, where it has any, are kept proper.
        placement: Where its vertices lie.
        rounds: How many.
        progress: Told the share of the rounds that are done.

    Raises:
        SettingsError: The mesh has triangles.
        CallError: Mesh and placement do not belong together.
    """
    return Rounds(mesh, placement).run(rounds, progress)


class Rounds:
    """The state of remeshing between rounds; an array is freed as soon as the next one replaces it.

    So a caller that drops the mesh and its placement before `run` has their memory back in it.
    """

    def __init__(self, mesh: Mesh, placement: Placement) -> None:
        """Take a mesh; the arguments are those of `remesh`."""
        mesh = connect(require_quads(mesh, "--remesh")).with_face_values({DEFECT: None})
        require_places(mesh, placement)
        self._affine = placement.frame.affine
        mesh, placement = in_near_frame(mesh, placement)
        values = {**mesh.vertex_values, FROZEN: frozen_vertices(mesh)}
        self._frame, self._device = placement.frame, mesh.device
        self._context = make_context(self._frame)
        self._mesh = working_mesh(replace(mesh, vertex_values=values), placement)
        start, grid = mesh.require_halfedges().vertex_halfedge, self._frame.grid
        self._first_warp = measure_warp(self._mesh)
        self._tracked = track_vertices(grid, start, placement.cell, placement.local, self._device)

    def run(self, rounds: int, progress: Progress = SILENT) -> Remeshed:
        """Return the mesh after `rounds` rounds; once only."""
        first_quads, operations = self._mesh.face_count, 0
        self._relax(RELAXED_FIRST)
        for n in range(rounds):
            progress.advance(n / rounds)
            operations += self._sweep(_rules(n, rounds, self._mesh.face_count / max(first_quads, 1)))
            if (n + 1) % RELAX_EVERY == 0 or n + 1 == rounds:
                self._relax(1 if n + 1 < rounds else RELAXED_LAST)
        for n in range(MOST_MENDINGS):
            high = flag_high(self._mesh, self._context)
            if n >= MENDINGS and self._device.total(high) == 0:
                break
            self._mend(high, n)
        return self._result(operations)

    def _result(self, operations: int) -> Remeshed:
        """Return what the rounds have made."""
        mesh, placement = self._mesh.as_mesh()
        values = {name: found for name, found in mesh.vertex_values.items() if name != FROZEN}
        color = mesh.face_values.get(COLOR)
        if color is not None:
            seams = wp.array(np.arange(4 * mesh.face_count, dtype=np.int32), device=self._device.name)
            repair_colors(self._device, self._mesh.arrays.twin, color, seams)
        mesh, placement = in_frame_of(self._affine, replace(mesh, vertex_values=values), placement)
        return Remeshed(mesh, placement, operations)

    def _relax(self, steps: int) -> None:
        """Take some steps of smoothing."""
        mesh, placement = relax(*self._mesh.as_mesh(), steps, tracked=self._tracked)
        self._mesh = working_mesh(mesh, placement)

    def _sweep(self, rules: Any) -> int:
        """Sweep over the mesh once; return how many operations were done."""
        device, grid = self._device, self._frame.grid
        self._tracked = with_nearer_quads(self._tracked, grid, self._mesh.arrays, device)
        regions = make_regions(self._mesh, grid, rules.round)
        vertices, quads = self._mesh.vertex_count, self._mesh.face_count
        work = self._make_work(regions)
        inputs = [self._context, rules, regions.starts, regions.items, regions.spare_starts, vertices, quads]
        for visits in portions(regions, PASSES):
            device.launch(sweep_kernel, regions.count, [*inputs, *visits], [work], grain=1, longest=1)
        done = int(work.tally.numpy()[:, CHANGES].sum())
        del work, regions, inputs
        self._close_gaps(vertices, quads)
        return done

    def _mend(self, high: Any, number: int) -> None:
        """Mend the worst quads and those at vertices flagged `high`."""
        shape = measure_shapes(self._mesh.as_mesh()[0]).numpy()
        limits = Limits()
        limits.bad = float(np.quantile(shape, BAD_SHARE)) if len(shape) else 0.0
        limits.warp_cosine = self._first_warp.least_cosine()
        limits.height, limits.may_fold = HEIGHT_LIMIT, int(number >= MENDINGS)
        del shape
        regions = make_regions(self._mesh, self._frame.grid, number)
        vertices, quads = self._mesh.vertex_count, self._mesh.face_count
        work = self._make_work(regions)
        inputs = [self._context, regions.starts, regions.items, high, limits]
        for visits in portions(regions, MEND_PASSES):
            self._device.launch(mend_kernel, regions.count, [*inputs, *visits], [work], grain=1, longest=1)
        del work, regions, inputs
        self._close_gaps(vertices, quads)

    def _make_work(self, regions: Regions) -> Any:
        """Make room in the mesh; return its bench, where each region has its share of the warp's slack."""
        warp, vertices = measure_warp(self._mesh), self._mesh.vertex_count
        self._mesh = with_room(self._mesh, regions.spare)
        work = make_work(self._mesh, self._tracked, regions, vertices, self._context)
        open_accounts(work, regions, self._first_warp, warp, self._device)
        return work

    def _close_gaps(self, vertices: int, quads: int) -> None:
        """Renumber the mesh without what was removed; vertices and quads from these numbers on are new."""
        inherit_values(self._mesh, vertices, quads)
        self._mesh, new_faces = pack(self._mesh)
        nearest = renumbered(self._tracked.nearest_quad, new_faces, self._device)
        self._tracked = replace(self._tracked, nearest_quad=nearest)


def _rules(number: int, rounds: int, share: float) -> Any:
    """Return the rules of round `number`, from 0, of `rounds`, where `share` of the first quads remain."""
    rules = Rules()
    rules.round, rules.tries = number, TRIES
    rules.temperature = TEMPERATURE * max(0.0, 1.0 - number / ((1.0 - COLD_SHARE) * rounds))
    cooled = number / max(rounds - 1, 1)
    rules.warp_price = FIRST_WARP_PRICE + (LAST_WARP_PRICE - FIRST_WARP_PRICE) * cooled
    rules.price = float(np.clip(PRICE_SLOPE * (LEAST_SHARE - share), 0.0, 2.0))
    return rules
