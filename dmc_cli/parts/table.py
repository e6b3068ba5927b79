"""Cut the table that a scan's body lies on, and what holds it: thin things that go along the slices.

A body is thick: what of the tissue a ball of `THICK` mm fits into, without small pieces, is body, and so is
what stands out of it, ears and fingers. What is left beside it in a piece that goes through half of the
slices and is wide is a table, a rail, a holder or a cable. Its nodes are flipped at the level that parts
tissue from air.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray
from dmc_cli.field import DeviceVolume, upload_volume
from dmc_cli.parts.components import Components, NodeSets, find_components, find_sets, mark_components
from dmc_cli.parts.flips import flip_nodes
from dmc_cli.parts.morphology import ball_of, opened
from dmc_cli.settings import SurfaceSettings

THICK = 16.0
"""Millimetres that a body is thick, at least, and a table's top and sides are not."""

BODY_SHARE = 0.02
"""Share of the largest thick piece's volume that another one has to be body."""

SLICES_SHARE, WIDE_SHARE = 0.5, 0.25
"""Share of the slices that a table goes through at least, and of the width or height that it takes."""


def cut_table(volume: DeviceVolume, level: float) -> tuple[DeviceVolume, dict[str, Any]]:
    """Return the volume without the table, and how much went.

    Args:
        volume: The volume on its device.
        level: The physical value that parts tissue from air.

    Raises:
        SettingsError: Nodes are so far apart that no two lie in what is thick.
    """
    settings, device = SurfaceSettings(isovalue=level), volume.device
    sets = find_sets(volume, settings)
    grid, bits = sets.grid, sets.inside.numpy()
    ball = ball_of(THICK / 2, volume.volume.spacing, "cut_table")
    thick = NodeSets(opened(sets.inside, ball, grid, device), None, grid)
    found = find_components(volume, settings, thick, of_object=True)
    is_body = found.volume_mm3 >= BODY_SHARE * (found.volume_mm3[0] if len(found) else 0.0)
    rest = bits & ~mark_components(found, is_body, grid, volume)
    left = NodeSets(wp.array(rest, dtype=wp.uint32, device=device.name), None, grid)
    pieces = find_components(volume, settings, left, of_object=True)
    table = _is_table(pieces, volume.volume.shape)
    told = {
        "components": int(np.count_nonzero(table)),
        "nodes": int(pieces.nodes[table].sum()),
        "volume": float(pieces.volume_mm3[table].sum()),
    }
    if not table.any():
        return volume, told
    values = volume.volume.values.copy()
    flip_nodes(volume.volume, values, level, mark_components(pieces, table, grid, volume))
    return upload_volume(replace(volume.volume, values=values, gradient=None, formula=None), device), told


def _is_table(pieces: Components, shape: tuple[int, int, int]) -> BoolArray:
    """Return which pieces beside a body go along the slices, and are wide."""
    extent = (pieces.high - pieces.low + 1) / np.array(shape)
    found: BoolArray = (extent[:, 2] >= SLICES_SHARE) & (extent[:, :2].max(axis=1, initial=0.0) >= WIDE_SHARE)
    return found
