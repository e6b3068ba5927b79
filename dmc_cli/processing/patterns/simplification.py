"""Simplify by the papers' patterns (Grosso & Zint 2021, section 4) and rules that keep the mesh whole.

Order: 3-X-3-Y, then 3-3-3-3. Under the papers' rules 3-X-3-Y is two passes, by colour and by counting.
Under the safe rules it sweeps until no quad that may go is left; a second pass would find one in ten
thousand. Valences, twins and non-manifold edges are up to date before each pass, as after the papers'
rebuild.
"""

from dataclasses import dataclass

import warp as wp

from dmc_cli.bits import keep_masked
from dmc_cli.errors import CallError
from dmc_cli.mesh import (
    COLOR,
    DEFECT,
    Mesh,
    Placement,
    WorkingMesh,
    connect,
    fill_gaps,
    in_frame_of,
    in_near_frame,
    require_places,
    require_quads,
    with_defects,
    working_mesh,
)
from dmc_cli.processing.color_repair import repair_colors
from dmc_cli.processing.patterns.masks import list_3x3y, list_3333
from dmc_cli.processing.patterns.removal_3x3y import remove_3x3y
from dmc_cli.processing.patterns.simplify_3x3y import choose_apart, choose_by_paper, judge_topology
from dmc_cli.processing.patterns.simplify_3333 import (
    REMOVED_TOGETHER,
    choose_unshared,
    judge_3333,
    remove_3333,
    still_waiting,
)
from dmc_cli.settings import MeshSettings


@dataclass(frozen=True)
class Simplified:
    """A mesh after simplification.

    Attributes:
        mesh: Its vertices, quads and halfedges.
        placement: Where its vertices lie.
        removed_3x3y: Quads that each pass of 3-X-3-Y removed.
        removed_3333: Quads that 3-3-3-3 removed.
        refused: Quads with a pattern that the safe rules kept.
    """

    mesh: Mesh
    placement: Placement
    removed_3x3y: tuple[int, ...]
    removed_3333: int
    refused: int


def simplify(mesh: Mesh, placement: Placement, settings: MeshSettings) -> Simplified:
    """Remove the papers' patterns; the arrays of mesh and placement are of no use afterwards.

    Args:
        mesh: A mesh of quads. Its colours, 0 to 4, are kept proper where it has any; the papers' rules need
            them.
        placement: Where its vertices lie.
        settings: Which patterns, by which rules, and whether merged vertices go back on the surface.

    Raises:
        SettingsError: The mesh has triangles.
        CallError: Mesh and placement do not belong together, or colours are missing that the papers' rules
            need.
    """
    mesh = with_defects(connect(require_quads(mesh, "--simplify")))
    _require_colors(mesh, settings)
    require_places(mesh, placement)
    affine = placement.frame.affine
    working = working_mesh(*in_near_frame(mesh, placement))
    removed: list[int] = []
    removed_3333 = refused = 0
    safe = settings.simplify_rules == "safe"
    if settings.simplify in ("3x3y", "all"):
        if safe:
            gone, refused = _safe_3x3y(working, project=settings.project)
            removed.append(gone)
        else:
            removed = [
                _paper_3x3y(working, by_color=by_color, project=settings.project)
                for by_color in (True, False)
            ]
    if settings.simplify in ("3333", "all"):
        removed_3333, kept = _pass_3333(working, safe=safe)
        refused += kept
    color = working.face_values.get(COLOR)
    if color is not None:
        arrays = working.arrays
        repair_colors(working.device, arrays.twin, color, *working.seams, gone=arrays.face_gone)
    simplified, places = in_frame_of(affine, *fill_gaps(working))
    simplified = simplified.with_face_values({DEFECT: None})
    return Simplified(simplified, places, tuple(removed), removed_3333, refused)


def _require_colors(mesh: Mesh, settings: MeshSettings) -> None:
    """Raise CallError if the rules choose by colours, and the mesh has none."""
    if settings.follows_paper and settings.simplify != "3333" and COLOR not in mesh.face_values:
        raise CallError(
            "the mesh has no colours of faces, by which the papers' rules choose; call connect_faces and"
            " color_faces on the surface first, or simplify with simplify_rules='safe'"
        )


def _paper_3x3y(mesh: WorkingMesh, *, by_color: bool, project: bool) -> int:
    """Remove quads by the papers' rules; return how many."""
    cuts = choose_by_paper(mesh, list_3x3y(mesh), by_color=by_color)
    removed, _ = remove_3x3y(mesh, cuts, project=project, safe=False)
    return mesh.device.total(removed)


def _safe_3x3y(mesh: WorkingMesh, *, project: bool) -> tuple[int, int]:
    """Remove quads in sweeps until none that may go is left; return how many went and were refused."""
    device = mesh.device
    state = device.zeros(mesh.face_count, wp.uint8)
    quads = list_3x3y(mesh)
    gone = refusals = 0
    while quads.shape[0]:
        cuts, refused = judge_topology(mesh, quads, state)
        chosen, waiting = choose_apart(mesh, cuts, state)
        removed, folded = remove_3x3y(mesh, chosen, project=project, safe=True, state=state)
        gone += device.total(removed)
        refusals += device.total(refused) + device.total(folded)
        quads = keep_masked(device, quads, waiting)
    return gone, refusals


def _pass_3333(mesh: WorkingMesh, *, safe: bool) -> tuple[int, int]:
    """Remove the pattern 3-3-3-3; return how many quads were removed and how many patterns were refused."""
    device = mesh.device
    quads = list_3333(mesh)
    removed = refusals = 0
    while quads.shape[0]:
        eligible, refused = judge_3333(mesh, quads, safe=safe)
        flags = choose_unshared(mesh, quads, eligible) if safe else eligible
        remove_3333(mesh, quads, flags)
        removed += REMOVED_TOGETHER * device.total(flags)
        refusals += device.total(refused)
        quads = still_waiting(device, quads, eligible, flags)
    return removed, refusals
