"""Take quads away in rounds of local collapses until a wanted number is left (`--quads`).

A round rates the diagonals of all quads (`costs.py`), sweeps over the regions, which collapse the cheap ones
(`sweep.py`), closes the gaps, and polishes what is left. Every collapse is judged as it is done (`judge.py`),
so after each round the mesh is as manifold, as unfolded and of as many components and tunnels as before it.
What is left to take away is shared out among the regions by how many cheap quads each has; the last few are
taken in one region. So the number is met to the quad, as long as collapses are found.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Int64Array
from dmc_cli.mesh import (
    COLOR,
    DEFECT,
    OWN_PREFIX,
    REGULAR,
    Mesh,
    Placement,
    WorkingMesh,
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
from dmc_cli.processing.decimation.actions import Sweep
from dmc_cli.processing.decimation.bound import SHARE, Bound, Keeper, State
from dmc_cli.processing.decimation.candidates import Candidates, find_candidates
from dmc_cli.processing.decimation.fine_points import ROW_STEP, ROWS
from dmc_cli.processing.decimation.guard import NOWHERE, Guard
from dmc_cli.processing.decimation.own_surface import own_normals, own_placement
from dmc_cli.processing.decimation.points import mean_side, nearest_quads
from dmc_cli.processing.decimation.sizes import size_weights
from dmc_cli.processing.decimation.sweep import REASONS, sweep_kernel
from dmc_cli.processing.distance_guard import TrackedPoints, renumbered, track_vertices
from dmc_cli.processing.relaxation import find_normals
from dmc_cli.processing.remeshing import (
    FROZEN,
    SIDE,
    TRACKED,
    Regions,
    Work,
    frozen_vertices,
    make_regions,
    portions,
    take_mesh,
    take_points,
    take_regions,
)
from dmc_cli.processing.tangent_step import make_context
from dmc_cli.progress import SILENT, Progress

CHEAP_SHARE = 0.08
"""Of the quads that can go, the cheapest ones, which a round may collapse; all where they lead on no more."""

PER_STEP = 6.0
"""The factor of cost of a unit of irregularity: short diagonals decide among collapses of the same one."""

FINE_SHARE, COARSE_SHARE = 0.33, 0.22
"""How far the fine vertices may be from the coarse quads, and samples of these from the surface after a
collapse, against the mean side that there will be at last."""

POLISHED_SHARE = 0.5
"""The latter after polishing: what samples are held against is coarse, and the fine vertices guard, too."""

LEAST_SHAPES = (0.5, 0.5, 0.3, 0.1, 0.1)
"""Shapes below which no quad may become worse: after each round that has led on too little, the next one. The
first holds for the cheapest quads, the others for all."""

LEAST_PROGRESS = 50
"""Of so many quads a round must take one away, or all that are too many."""

FIRST_POLISHES, LAST_POLISHES = 2, 16
"""Polishings before the rounds and after them."""

TRIES, LAST_TRIES = 1, 8
"""Rotations tried at an irregular vertex each time that it is polished, between the rounds and after them."""

STRIDES = (0.2, 0.1, 0.05) * 4
"""Steps of fitting at last, against the mean side: one sweep each, every other 45 degrees off."""

EFFORT, LEAST_VAIN, MOST_VAIN = 1.7, 8, 64
"""Rotations that may be tried in vain for each vertex of the mesh; irregular ones share them, at least and at
most so many each."""

AT_ONCE = 256
"""Quads that are taken away in one region: shares of fewer would leave most regions without any."""

POINTS_A_PATCH = 40
"""Quads whose tracked points a patch has room for, were they spread evenly."""

REFUSED = OWN_PREFIX + "refused"
"""The value of the working mesh's quads that tells how often their collapse was refused, uint8."""

NORMAL, VAIN, STILL = OWN_PREFIX + "normal", OWN_PREFIX + "vain", OWN_PREFIX + "still"
"""Values of its vertices: the surface's unit normals, vec3; uint8, how many rotations were tried in vain, and
whether they cannot glide."""

OWN_VALUES = (FROZEN, NORMAL, VAIN, STILL)
"""Values of the vertices that the result does not have."""

REASON_NAMES = ("topology", "shape", "distance")
"""What the refusals are counted by, in the order of `sweep.py`."""


@dataclass(frozen=True)
class Decimated:
    """A mesh with fewer quads.

    Attributes:
        mesh: Its vertices, quads and halfedges.
        placement: Where its vertices lie; None where there is no field.
        wanted: Quads that were asked for; where the mesh has more, no further collapse was found.
        rounds: Rounds of collapses.
        refusals: Collapses that the last round refused, by reason: `topology`, `shape` or `distance`.
        fixed: Quads that stay for a vertex on a boundary, or one whose quads do not form one ring.
    """

    mesh: Mesh
    placement: Placement | None
    wanted: int
    rounds: int
    refusals: dict[str, int]
    fixed: int


def decimate(
    mesh: Mesh,
    placement: Placement | None,
    quads: int,
    progress: Progress = SILENT,
    bound: Bound | None = None,
) -> Decimated:
    """Return the mesh with at most `quads` quads, or as few as can be had; no array is changed.

    Args:
        mesh: A mesh of quads. Colours, where it has any, are kept proper.
        placement: Where its vertices lie on a field's surface. Without it the mesh itself is the surface.
        quads: How many to leave. A mesh that has no more is returned as it is.
        progress: Told the share of the quads that are gone.
        bound: How far the mesh may go from what it is, where that is asked for.

    Raises:
        SettingsError: The mesh has triangles.
        CallError: Mesh and placement do not belong together.
    """
    return Decimation(mesh, placement, bound).run(quads, progress)


class Decimation:
    """The state between rounds; an array is freed as soon as the next one replaces it.

    So a caller that drops the mesh and its placement before `run` has their memory back in it.
    """

    _mesh: WorkingMesh
    _tracked: TrackedPoints
    _rounds: int
    _eased: int

    def __init__(self, mesh: Mesh, placement: Placement | None, bound: Bound | None = None) -> None:
        """Take a mesh; the arguments are those of `decimate`."""
        mesh = connect(require_quads(mesh, "--quads"))
        self._has_field = placement is not None
        if placement is not None:
            require_places(mesh, placement)
        self._given, self._bound = (mesh, placement), bound

    def run(self, quads: int, progress: Progress = SILENT) -> Decimated:
        """Return the mesh with at most `quads` quads, or as few as can be had; once only."""
        mesh, placement = self._given
        if mesh.face_count <= quads:
            return Decimated(mesh, placement, quads, 0, dict.fromkeys(REASON_NAMES, 0), 0)
        del self._given
        placement = placement or own_placement(mesh)
        self._affine = placement.frame.affine
        self._begin(*in_near_frame(mesh.with_face_values({DEFECT: None}), placement))
        del mesh, placement
        keeper = None if self._bound is None else Keeper(self._bound, self._state())
        for n in range(FIRST_POLISHES):
            self._polish(n, 0)
        self._first, self._refusals = self._mesh.face_count, [0] * REASONS
        is_done = False
        while not is_done:
            while self._has_more(quads):
                self._round(quads, progress)
                if keeper is not None and keeper.is_due(self._mesh.face_count):
                    self._hold(keeper)
            for n in range(LAST_POLISHES):
                self._polish(self._rounds + n, LAST_TRIES)
            for n, stride in enumerate(STRIDES):
                self._polish(self._rounds + n, 0, stride)
            is_done = keeper is None or self._hold(keeper) or keeper.is_given_up
        mesh, placement = self._result()
        reasons = dict(zip(REASON_NAMES, self._refusals, strict=True))
        return Decimated(mesh, placement, quads, self._rounds, reasons, self._fixed)

    def _has_more(self, quads: int) -> bool:
        """Return whether there are too many quads, and rules to be eased yet."""
        return self._mesh.face_count > quads and self._eased < len(LEAST_SHAPES)

    def _round(self, quads: int, progress: Progress) -> None:
        """Take quads away, ease the rules where that led on too little, and polish what is left."""
        before = self._mesh.face_count
        progress.advance((self._first - before) / (self._first - quads))
        self._refusals = self._collapse(self._rounds, quads, self._eased)
        self._rounds += 1
        if before - self._mesh.face_count < max(1, min(before - quads, before // LEAST_PROGRESS)):
            self._eased += 1
        self._polish(self._rounds, TRIES)

    def _state(self) -> State:
        """Return what the rounds have made so far."""
        return State(self._mesh, self._tracked, self._eased)

    def _hold(self, keeper: Keeper) -> bool:
        """Return whether the bound holds; else the mesh is the last one that it holds for."""
        self._assign_nearest()
        mesh, _ = in_frame_of(self._affine, *self._mesh.as_mesh())
        state, holds = keeper.next_state(mesh, self._state())
        self._mesh, self._tracked, self._eased = state.mesh, state.tracked, state.eased
        take_mesh(self._work, self._mesh, self._mesh.vertex_values[NORMAL])
        if keeper.is_given_up:
            self._eased = len(LEAST_SHAPES)
        return holds

    def _assign_nearest(self) -> None:
        """Assign tracked points to nearer quads."""
        nearest = nearest_quads(self._tracked, self._place, self._mesh)
        self._tracked = replace(self._tracked, nearest_quad=nearest)

    def _begin(self, mesh: Mesh, placement: Placement) -> None:
        """Take a mesh in the near frame, and its vertices as tracked points."""
        self._frame, self._device = placement.frame, mesh.device
        self._context = make_context(self._frame)
        start = mesh.require_halfedges().vertex_halfedge
        frozen = frozen_vertices(mesh)
        self._fixed = int((frozen.numpy()[mesh.faces.numpy()] != 0).any(axis=1).sum())
        vain, still = (self._device.zeros(mesh.vertex_count, wp.uint8) for _ in range(2))
        if self._has_field:
            self._normal = find_normals(self._context, placement.cell, placement.local, self._device)
        else:
            self._normal = own_normals(mesh)
        own = dict(zip(OWN_VALUES, (frozen, self._normal, vain, still), strict=True))
        face_values = {**mesh.face_values, REFUSED: self._device.zeros(mesh.face_count, wp.uint8)}
        mesh = replace(mesh, vertex_values={**mesh.vertex_values, **own}, face_values=face_values)
        self._tracked = track_vertices(self._frame.grid, start, placement.cell, placement.local, self._device)
        self._place = wp.clone(mesh.positions)
        self._mesh = with_room(working_mesh(mesh, placement), 0)  # a copy: sweeps change it in place
        self._fine_edge, self._rounds, self._eased = mean_side(self._mesh), 0, 0
        self._work = Work()
        take_mesh(self._work, self._mesh, self._mesh.vertex_values[NORMAL])

    def _collapse(self, number: int, quads: int, eased: int) -> list[int]:
        """Collapse quads, by rules that are eased, `quads` being left; return the refusals by reason."""
        edge, more = mean_side(self._mesh), self._mesh.face_count - quads
        self._assign_nearest()
        regions = self._regions(number, edge, is_whole=more <= AT_ONCE)
        refused, weight = self._mesh.face_values[REFUSED], size_weights(self._mesh)
        found = find_candidates(self._mesh, regions, refused, weight, PER_STEP, 1.0 if eased else CHEAP_SHARE)
        sweep = self._sweep(regions, number, edge)
        sweep.quota = wp.array(share_out(found.counts, more), dtype=wp.int32, device=self._device.name)
        sweep.weight, sweep.threshold = weight, found.threshold
        self._launch(sweep, regions, found, edge, quads, LEAST_SHAPES[eased])
        refusals: list[int] = sweep.refusals.numpy().sum(axis=0).tolist()
        self._mesh, new_faces = pack(self._mesh)
        take_mesh(self._work, self._mesh, self._mesh.vertex_values[NORMAL])
        nearest = renumbered(self._tracked.nearest_quad, new_faces, self._device)
        self._tracked = replace(self._tracked, nearest_quad=nearest)
        return refusals

    def _polish(self, number: int, tries: int, stride: float = 0.0) -> None:
        """Rotate edges round irregular vertices; let all vertices glide, or fit them if there is a stride."""
        edge = mean_side(self._mesh)
        regions = self._regions(number, edge)
        sweep = self._sweep(regions, number, edge)
        sweep.quota = self._device.zeros(regions.count, wp.int32)
        sweep.tries, sweep.stride = tries, stride
        sweep.most_vain = self._most_vain() if tries else 0
        self._launch(sweep, regions, None, edge, self._mesh.face_count, LEAST_SHAPES[0])

    def _most_vain(self) -> int:
        """Return how many rotations may be tried in vain at a vertex: fewer where many are irregular."""
        irregular = np.count_nonzero(self._mesh.arrays.valence.numpy() != REGULAR)
        return int(np.clip(EFFORT * self._mesh.vertex_count / max(irregular, 1), LEAST_VAIN, MOST_VAIN))

    def _launch(
        self,
        sweep: Any,
        regions: Regions,
        found: Candidates | None,
        edge: float,
        quads: int,
        least_shape: float,
    ) -> None:
        """Sweep over the candidates, or polish where there are none given."""
        faces = self._mesh.face_count
        points = max(TRACKED, POINTS_A_PATCH * self._tracked.count // max(faces, 1))
        points += -points % ROW_STEP
        take_points(self._work, self._tracked, self._mesh)
        take_regions(self._work, regions, self._mesh.vertex_count, points, self._device)
        lists = regions if found is None else replace(regions, starts=found.starts, items=found.items)
        coarse = edge * max(1.0, faces / max(quads, 1)) ** 0.5
        guard = self._guard(coarse, POLISHED_SHARE if found is None else COARSE_SHARE, least_shape)
        guard.copies = self._device.empty((regions.count, ROWS, points), wp.float32)
        inputs = [self._context, guard, found is None, lists.starts, lists.items]
        for visits in portions(lists, 1):
            outputs = [sweep, self._work]
            self._device.launch(sweep_kernel, regions.count, [*inputs, *visits], outputs, grain=1, longest=1)

    def _guard(self, edge: float, share: float, least_shape: float) -> Any:
        """Return what holds where the mean side will be `edge`."""
        guard = Guard()
        guard.place, guard.normal, guard.has_field = self._place, self._normal, self._has_field
        guard.farthest, guard.highest, guard.spacing = FINE_SHARE * edge, share * edge, float(NOWHERE)
        guard.reach, guard.least_shape = self._fine_edge, least_shape
        if self._bound is not None:
            scale = np.linalg.norm(self._frame.affine[:3, 0]) / np.linalg.norm(self._affine[:3, 0])
            most = SHARE * float(scale) * self._bound.distance
            guard.farthest, guard.highest = min(guard.farthest, most), min(guard.highest, most)
            guard.spacing = self._fine_edge
        return guard

    def _regions(self, number: int, edge: float, *, is_whole: bool = False) -> Regions:
        """Divide the mesh into boxes of so many quads as cells in those of remeshing, or into one."""
        grid = self._frame.grid
        cell = float(np.linalg.norm(self._frame.affine[:3, :3], axis=0).min())
        side = max(SIDE, int(SIDE * edge / cell))
        if is_whole:
            side, number = max(grid.nx, grid.ny, grid.nz) + 1, 0
        return make_regions(self._mesh, grid, number, side)

    def _sweep(self, regions: Regions, number: int, edge: float) -> Any:
        """Return the kernels' account of a sweep that is about to begin."""
        sweep = Sweep()
        sweep.taken = self._device.zeros(regions.count, wp.int32)
        sweep.refusals = self._device.zeros((regions.count, REASONS), wp.int32)
        sweep.refused = self._mesh.face_values[REFUSED]
        sweep.vain, sweep.still = (self._mesh.vertex_values[name] for name in (VAIN, STILL))
        sweep.per_step, sweep.edge, sweep.seed = PER_STEP, edge, number
        sweep.tries, sweep.stride = 0, 0.0
        return sweep

    def _result(self) -> tuple[Mesh, Placement | None]:
        """Return what the rounds have made."""
        mesh, placement = self._mesh.as_mesh()
        vertex_values = {n: found for n, found in mesh.vertex_values.items() if n not in OWN_VALUES}
        face_values = {n: found for n, found in mesh.face_values.items() if n != REFUSED}
        color = face_values.get(COLOR)
        if color is not None:
            seams = wp.array(np.arange(4 * mesh.face_count, dtype=np.int32), device=self._device.name)
            repair_colors(self._device, self._mesh.arrays.twin, color, seams)
        mesh = replace(mesh, vertex_values=vertex_values, face_values=face_values)
        mesh, placement = in_frame_of(self._affine, mesh, placement)
        return mesh, placement if self._has_field else None


def share_out(candidates: Int64Array, more: int) -> Int64Array:
    """Return how many quads each region may take away, int64 (R,): at most `more` in all.

    The shares are as the candidates, rounded so that they add up; the largest rests are rounded up, the first
    of equal ones.
    """
    total = int(candidates.sum())
    if total <= more:
        return candidates
    shares = candidates * (more / total)
    quota = np.floor(shares).astype(np.int64)
    order = np.argsort(quota - shares, kind="stable")
    quota[order[: more - int(quota.sum())]] += 1
    return quota
