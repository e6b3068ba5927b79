"""Open and close the object, keep some of its components, fill what it encloses, and tell what was done.

Components are joined along the grid's edges, so a dropped node's neighbours are dropped as well or lie
outside: every crossed edge of what stays is crossed where it was. Only in cells that a dropped component
shares with one that stays, which touch across a cell's face or corners, does the trilinear function change,
and with it where in the cell a vertex lies. What is filled was enclosed along the edges; leaks across faces
are closed.
"""

from typing import Any

import numpy as np

from dmc_cli.array_types import BoolArray
from dmc_cli.errors import EmptySurfaceError
from dmc_cli.field import DeviceVolume
from dmc_cli.parts.components import (
    Components,
    Reserve,
    find_components,
    find_sets,
    mark_components,
    size_of,
    tally,
)
from dmc_cli.parts.flips import flipped_volume
from dmc_cli.settings import PartSettings, SurfaceSettings
from dmc_cli.volume import Volume

LISTED = 1000
"""Components that are listed, at most."""

SPECK = 1e-3
"""A component is a speck if its volume is less than this share of the largest one's."""


def list_components(
    volume: DeviceVolume, settings: SurfaceSettings, reserve: Reserve | None = None
) -> dict[str, Any]:
    """Return the object's components, as a report has them; the arguments are those of `select_part`."""
    sets = find_sets(volume, settings)
    found = find_components(volume, settings, sets, of_object=True, reserve=reserve)
    return _section(found, volume.volume)


def select_part(
    volume: DeviceVolume, settings: SurfaceSettings, part: PartSettings, reserve: Reserve | None = None
) -> tuple[DeviceVolume, dict[str, Any]]:
    """Return a volume whose object is the part that is wanted, and what was done.

    Args:
        volume: The volume on its device.
        settings: The isovalue, a number, and which side is the object.
        part: Which components to keep, which cavities to fill.
        reserve: Is told how many bytes are about to be taken in all; it may raise.

    Raises:
        EmptySurfaceError: No component is left.
    """
    size = volume.volume.values.nbytes

    def reserve_beside(more: int) -> None:
        if reserve is not None:
            reserve(size + more)

    reserve_beside(0)
    values = volume.volume.values.copy()
    told: dict[str, Any] = {}
    for option, name in (("open_gaps", "opened"), ("close_gaps", "closed")):
        if getattr(part, option) is not None:
            volume, told[name] = _reshaped(volume, settings, values, option, getattr(part, option))
    volume, kept = _with_kept(volume, settings, values, part, reserve_beside)
    told |= kept
    if part.largest_cavity is not None:
        volume, told["filled"] = _filled(volume, settings, values, part.largest_cavity, reserve_beside)
    return volume, told


def _with_kept(
    volume: DeviceVolume, settings: SurfaceSettings, values: Any, part: PartSettings, reserve: Reserve
) -> tuple[DeviceVolume, dict[str, Any]]:
    """Return the volume without components that are not kept, those that there were, and how much went."""
    sets = find_sets(volume, settings)
    found = find_components(volume, settings, sets, of_object=True, reserve=reserve)
    told = {"components": _section(found, volume.volume)}
    dropped = _dropped(found, part)
    if len(found) and dropped.all():
        raise EmptySurfaceError(
            f"no component is left: the largest of {len(found)} has {found.volume_mm3[0]:g} mm3; expected one"
            f" of at least {part.min_volume:g} mm3; choose a smaller --min-volume"
        )
    if part.most_kept is not None or part.min_volume is not None:
        told["dropped"] = tally(found, dropped)
    if dropped.any():
        volume = flipped_volume(
            volume, settings.settled_isovalue, values, mark_components(found, dropped, sets.grid, volume)
        )
    return volume, told


def _filled(
    volume: DeviceVolume, settings: SurfaceSettings, values: Any, largest: float, reserve: Reserve
) -> tuple[DeviceVolume, dict[str, Any]]:
    """Return the volume with cavities up to a volume in mm3 filled, and how much came."""
    sets = find_sets(volume, settings)
    outer = find_components(volume, settings, sets, of_object=False, reserve=reserve)
    filled = ~outer.is_open & (outer.volume_mm3 <= largest)
    told = tally(outer, filled)
    if filled.any():
        volume = flipped_volume(
            volume, settings.settled_isovalue, values, mark_components(outer, filled, sets.grid, volume)
        )
    return volume, told


def _reshaped(
    volume: DeviceVolume, settings: SurfaceSettings, values: Any, option: str, width: float
) -> tuple[DeviceVolume, dict[str, Any]]:
    """Return the volume with its object opened or closed, and how much went or came."""
    from dmc_cli.parts import morphology

    sets, device = find_sets(volume, settings), volume.device
    ball = morphology.ball_of(width / 2, volume.volume.spacing, option)
    bits = sets.object_bits(is_inside=settings.inside == "above")
    is_opened = option == "open_gaps"
    change = morphology.opened if is_opened else morphology.closed
    changed = change(bits, ball, sets.grid, device).numpy() ^ bits.numpy()
    if sets.data is not None:
        changed &= sets.data.numpy()
    told = size_of(changed, sets.grid, volume.volume)
    if told["nodes"]:
        volume = flipped_volume(volume, settings.settled_isovalue, values, changed)
    return volume, told


def _dropped(found: Components, part: PartSettings) -> BoolArray:
    """Return which components are not kept."""
    dropped = np.zeros(len(found), bool)
    if part.most_kept is not None:
        dropped[part.most_kept :] = True
    if part.min_volume is not None:
        dropped |= found.volume_mm3 < part.min_volume
    return dropped


def _section(found: Components, volume: Volume) -> dict[str, Any]:
    """Return what a report has of components: how many, how many specks, and the largest ones."""
    limit = SPECK * found.volume_mm3[0] if len(found) else 0.0
    return {
        "count": len(found),
        "specks": int(np.count_nonzero(found.volume_mm3 < limit)),
        "speck_volume": float(limit),
        "listed": [
            {
                "nodes": int(found.nodes[n]),
                "volume": float(found.volume_mm3[n]),
                "bounds": _bounds(volume, found.low[n], found.high[n]),
            }
            for n in range(min(len(found), LISTED))
        ],
    }


def _bounds(volume: Volume, low: Any, high: Any) -> list[list[float]]:
    """Return the least and largest coordinates of a box of nodes, in mm of the volume's space."""
    ends = np.stack([low, high]).astype(np.float64)
    if volume.slice_positions is not None:
        ends[:, 2] = volume.slice_positions[[int(low[2]), int(high[2])]] / volume.spacing[2]
    corners = np.stack(np.meshgrid(*ends.T, indexing="ij")).reshape(3, -1)
    points = volume.affine[:3, :3] @ corners + volume.affine[:3, 3:]
    return [points.min(axis=1).tolist(), points.max(axis=1).tolist()]
