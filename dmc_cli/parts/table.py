"""Cut the table that a scan's body lies on, and what holds it: thin things that go along the slices.

A body is thick: what of the tissue a ball of `THICK` mm fits into, without small pieces, is body, and so is
what it encloses and what stands out of it, ears and fingers. What is left beside it in a piece that goes
through half of the slices and is wide is a table, a rail, a holder or a cable. Where the body touches such a
piece, an ear is told from a rail by its length: what is in the same place in half of the slices is table, and
of the rest what hangs together with the body is not. Nodes of the table are flipped at the level that parts
tissue from air.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray
from dmc_cli.field import DeviceVolume, grid_of
from dmc_cli.parts.components import (
    Components,
    NodeSets,
    Reserve,
    find_components,
    find_sets,
    mark_components,
    meeting_components,
    size_of,
    tally,
)
from dmc_cli.parts.flips import flipped_volume
from dmc_cli.parts.morphology import closed, large_ball_of, opened
from dmc_cli.parts.profile import profile_nodes
from dmc_cli.settings import SurfaceSettings

THICK = 16.0
"""Millimetres that a body is thick, at least, and a table's top and sides are not."""

BODY_SHARE = 0.02
"""Share of the largest thick piece's volume that another one has to be body."""

SLICES_SHARE, WIDE_SHARE = 0.5, 0.25
"""Share of the slices that a table goes through at least, and of the width or height that it takes."""
NEARBY, PROFILE_SHARE = 2.0, 0.5
"""Millimetres that a table may move between slices, and the share of its own in which it is in one place."""

SETS = 8
"""Sets of nodes that are there at a time, at most, a bit a node each."""


def cut_table(
    volume: DeviceVolume, level: float, reserve: Reserve | None = None
) -> tuple[DeviceVolume, dict[str, Any]]:
    """Return the volume without the table, and how much went.

    Args:
        volume: The volume on its device.
        level: The physical value that parts tissue from air.
        reserve: Is told how many bytes are about to be taken in all; it may raise.

    Raises:
        SettingsError: Nodes are so far apart that no two lie in what is thick.
    """
    grid, settings = grid_of(volume.volume.shape, 0), SurfaceSettings(isovalue=level)
    held = SETS * 4 * grid.rows * grid.words

    def reserve_beside(more: int) -> None:
        if reserve is not None:
            reserve(held + more)

    body, left = _body_and_rest(volume, settings, reserve_beside)
    pieces = find_components(volume, settings, left, of_object=True, reserve=reserve_beside)
    table = _is_table(pieces, volume.volume.shape)
    told = tally(pieces, table)
    if not table.any():
        return volume, told
    bits = mark_components(pieces, table, grid, volume)
    del pieces
    bits &= ~_of_body(bits, body, volume, settings, reserve_beside)
    reserve_beside(volume.volume.values.nbytes)
    values = volume.volume.values.copy()
    return flipped_volume(volume, level, values, bits), told | size_of(bits, grid, volume.volume)


def _body_and_rest(volume: DeviceVolume, settings: SurfaceSettings, reserve: Reserve) -> tuple[Any, NodeSets]:
    """Return the nodes that a body takes or encloses, uint32 [row, word], and others of tissue as a set."""
    sets, device = find_sets(volume, settings), volume.device
    ball = large_ball_of(THICK / 2, volume.volume.spacing, "cut_table")
    thick = NodeSets(opened(sets.inside, ball, sets.grid, device), None, sets.grid)
    found = find_components(volume, settings, thick, of_object=True, reserve=reserve)
    is_body = found.volume_mm3 >= BODY_SHARE * (found.volume_mm3[0] if len(found) else 0.0)
    core = wp.array(mark_components(found, is_body, sets.grid, volume), dtype=wp.uint32, device=device.name)
    body = closed(core, ball, sets.grid, device)
    rest = sets.inside.numpy() & ~body.numpy()
    return body, NodeSets(wp.array(rest, dtype=wp.uint32, device=device.name), None, sets.grid)


def _of_body(
    pieces: Any, body: Any, volume: DeviceVolume, settings: SurfaceSettings, reserve: Reserve
) -> Any:
    """Return the nodes of a body and what of pieces hangs together with it, uint32 [row, word]."""
    device, grid = volume.device, grid_of(volume.volume.shape, 0)
    on_device = wp.array(pieces, dtype=wp.uint32, device=device.name)
    profile = profile_nodes(on_device, volume.volume, device, NEARBY, PROFILE_SHARE)
    joined = wp.array(pieces & ~profile.numpy() | body.numpy(), dtype=wp.uint32, device=device.name)
    found = find_components(volume, settings, NodeSets(joined, None, grid), of_object=True, reserve=reserve)
    return mark_components(found, meeting_components(found, body, grid, volume), grid, volume)


def _is_table(pieces: Components, shape: tuple[int, int, int]) -> BoolArray:
    """Return which pieces beside a body go along the slices, and are wide."""
    extent = (pieces.high - pieces.low + 1) / np.array(shape)
    found: BoolArray = (extent[:, 2] >= SLICES_SHARE) & (extent[:, :2].max(axis=1, initial=0.0) >= WIDE_SHARE)
    return found
