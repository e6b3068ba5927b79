"""More irregular vertices removed than the papers' patterns can (`--simplify more`).

A round shifts the blocks, sweeps over them (`more_sweep.py`), closes the gaps and smooths; at last high and
bad quads are mended (`more_mend.py`). Every operation is judged as it is done, so after every round the mesh
is as manifold, as unfolded and as near to the surface and to the old vertices (`guests.py`) as before it. The
temperature falls to 0; a quad that goes costs more the fewer there are.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.device import Device
from dmc_cli.mesh.coloring import repair_colors
from dmc_cli.mesh.glide import make_scene
from dmc_cli.mesh.guests import Guests, list_guests, lodge_vertices, with_nearer_hosts
from dmc_cli.mesh.halfedges import Halfedges, flat_quads
from dmc_cli.mesh.more_blocks import Blocks, find_normals, freeze_fans, make_blocks, with_spares
from dmc_cli.mesh.more_mend import Limits, mark_high, mend_kernel
from dmc_cli.mesh.more_mesh import Mesh, with_room, without_gaps
from dmc_cli.mesh.more_sweep import HEIGHT_LIMIT, Rules, sweep_kernel
from dmc_cli.mesh.more_work import CHANGES, CORE, GUESTS, JOURNAL, LINKS, PATCH, TALLIES, Work
from dmc_cli.mesh.relax import measure_shapes, relax
from dmc_cli.progress import SILENT, Progress
from dmc_cli.surface import Surface

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


@dataclass(frozen=True)
class Improved:
    """A mesh after the rounds, and how many operations were done."""

    surface: Surface
    halfedges: Halfedges
    color: Any | None
    color24: Any | None
    operations: int


def simplify_more(
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
    device = surface.device
    colors = tuple(c for c in (color, color24) if c is not None)
    frozen = device.zeros(surface.vertices.shape[0], wp.uint8)
    first_quads, operations = surface.quads.shape[0], 0
    mesh = _mesh_of(surface, halfedges, colors, frozen, device)
    freeze_fans(mesh, device)
    guests = lodge_vertices(surface.grid, mesh.vertex_halfedge, mesh.cell, mesh.local, device)
    mesh = _relaxed(mesh, surface, guests, RELAXED_FIRST)
    scene = make_scene(surface)
    for turn in range(rounds):
        progress.advance(turn / rounds)
        rules = _rules(turn, rounds, mesh.quad_count / max(first_quads, 1))
        guests = with_nearer_hosts(guests, surface.grid, mesh, device)
        mesh, guests, done = _sweep(mesh, guests, surface, scene, rules)
        operations += done
        if (turn + 1) % RELAX_EVERY == 0 or turn + 1 == rounds:
            mesh = _relaxed(mesh, surface, guests, 1 if turn + 1 < rounds else RELAXED_LAST)
    for turn in range(MOST_MENDINGS):
        high = mark_high(mesh, scene, device)
        if turn >= MENDINGS and device.total(high) == 0:
            break
        mesh, guests = _mend(mesh, guests, high, surface, scene, turn)
    surface, halfedges = _surface_of(mesh, surface), _halfedges_of(mesh, device)
    kept = list(mesh.colors)
    color = kept.pop(0) if color is not None else None
    if color is not None:
        seams = wp.array(np.arange(4 * mesh.quad_count, dtype=np.int32), device=device.name)
        repair_colors(device, mesh.twin, color, seams)
    return Improved(surface, halfedges, color, kept[0] if kept else None, operations)


def _rules(turn: int, rounds: int, share: float) -> Any:
    """Return what holds in a round when a share of the quads is left."""
    rules = Rules()
    rules.round, rules.tries = turn, TRIES
    rules.temperature = TEMPERATURE * max(0.0, 1.0 - turn / ((1.0 - COLD_SHARE) * rounds))
    rules.price = float(np.clip(PRICE_SLOPE * (LEAST_SHARE - share), 0.0, 2.0))
    return rules


def _sweep(mesh: Mesh, guests: Guests, surface: Surface, scene: Any, rules: Any) -> tuple[Mesh, Guests, int]:
    """Return the mesh after one sweep, its guests, and how many operations were done."""
    device = surface.device
    blocks = make_blocks(mesh, surface.grid, rules.round, device)
    vertices, quads = mesh.vertex_count, mesh.quad_count
    roomy = with_room(mesh, blocks.spare, device)
    work = _work(roomy, guests, blocks, vertices, surface, scene)
    inputs = [scene, rules, blocks.starts, blocks.items, blocks.spare_starts, vertices, quads]
    device.launch(sweep_kernel, blocks.count, inputs, [work], grain=1)
    mesh, host = without_gaps(roomy, guests.host, device)
    return mesh, replace(guests, host=host), int(work.tally.numpy()[:, CHANGES].sum())


def _mend(
    mesh: Mesh, guests: Guests, high: Any, surface: Surface, scene: Any, turn: int
) -> tuple[Mesh, Guests]:
    """Return the mesh with its worst quads and those at vertices marked `high` mended, and its guests."""
    device = surface.device
    shape = measure_shapes(_surface_of(mesh, surface), _halfedges_of(mesh, device)).numpy()
    limits = Limits()
    limits.bad = float(np.quantile(shape, BAD_SHARE)) if len(shape) else 0.0
    limits.height, limits.may_fold = HEIGHT_LIMIT, int(turn >= MENDINGS)
    blocks = make_blocks(mesh, surface.grid, turn, device)
    roomy = with_room(mesh, blocks.spare, device)
    work = _work(roomy, guests, blocks, mesh.vertex_count, surface, scene)
    inputs = [scene, blocks.starts, blocks.items, high, limits]
    device.launch(mend_kernel, blocks.count, inputs, [work], grain=1)
    mesh, host = without_gaps(roomy, guests.host, device)
    return mesh, replace(guests, host=host)


def _work(mesh: Mesh, guests: Guests, blocks: Blocks, vertices: int, surface: Surface, scene: Any) -> Any:
    """Return the kernels' view of a mesh and its guests with benches for its blocks."""
    work, count, device = Work(), blocks.count, surface.device
    work.normal, work.sense = find_normals(mesh, scene, device), surface.sense
    work.guest_point, work.host = guests.point, guests.host
    work.first_guest, work.next_guest = list_guests(guests, mesh.quad_count, device)
    work.corners, work.twin, work.quad_gone = mesh.corners, mesh.twin, mesh.quad_gone
    work.vertex_halfedge, work.valence, work.vertex_gone = (
        mesh.vertex_halfedge,
        mesh.valence,
        mesh.vertex_gone,
    )
    work.position, work.cell, work.local = mesh.position, mesh.cell, mesh.local
    work.vertex_block = with_spares(blocks, vertices, device)
    work.journal_place = device.empty((count, JOURNAL), wp.int64)
    work.journal_value = device.empty((count, JOURNAL), wp.int32)
    work.chain = device.empty((count, LINKS), wp.int32)
    work.guest, work.new_host = (device.empty((count, GUESTS), wp.int32) for _ in range(2))
    work.core_valence = device.empty((count, CORE), wp.int32)
    work.core, work.core_cell = device.empty((count, CORE), wp.int32), device.empty((count, CORE), wp.int64)
    work.core_position = device.empty((count, CORE), wp.vec3)
    work.core_local = device.empty((count, CORE), wp.vec3)
    work.core_normal = device.empty((count, CORE), wp.vec3)
    work.patch = device.empty((count, PATCH), wp.int32)
    work.tally = device.zeros((count, TALLIES), wp.int32)
    return work


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


def _relaxed(mesh: Mesh, surface: Surface, guests: Guests, steps: int) -> Mesh:
    """Return the mesh after some steps of smoothing."""
    found = relax(_surface_of(mesh, surface), _halfedges_of(mesh, surface.device), steps, guests=guests)
    return replace(mesh, position=found.vertices, cell=found.vertex_cell, local=found.vertex_local)
