"""Tell what surfaces a volume has over the range of its values: a contour spectrum.

Active cells, area and components of the isosurface as functions of the isovalue show where materials begin
and end, and noise: Bajaj, Pascucci, Schikore (1997), The Contour Spectrum.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from dmc_cli.contouring import extract_surface
from dmc_cli.errors import EmptySurfaceError
from dmc_cli.field import upload_volume
from dmc_cli.measures import measure_quality, measure_topology
from dmc_cli.progress import SILENT, Progress
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume, intact

MOST_STEPS = 25
"""Isovalues that are chosen, at most."""


def contour_spectrum(
    volume: Volume, isovalues: Sequence[float] = (), threads: int | None = None, progress: Progress = SILENT
) -> list[dict[str, Any]]:
    """Return isovalue, active cells, their share, area in mm2 and components of each surface.

    Args:
        volume: The volume.
        isovalues: Levels in physical values; without any, round numbers over the volume's range.
        threads: CPU threads, all cores if None.
        progress: Who is told how far it is.
    """
    device = select_device("cpu", threads)
    with intact(volume.values, volume.path), progress.stage("contour spectrum"):
        levels = list(isovalues) or list(round_levels(volume.value_range()))
        on_device = upload_volume(volume, device, indexed=True)
        cells = math.prod(max(n - 1, 0) for n in volume.shape)
        rows = []
        for number, level in enumerate(levels, 1):
            rows.append({"isovalue": level, **_measures(on_device, level, cells)})
            progress.advance(number / len(levels))
    return rows


def round_levels(ends: tuple[float, float] | None) -> Iterator[float]:
    """Yield round numbers inside a range, `MOST_STEPS` at most, none for no range."""
    if ends is None or not ends[0] < ends[1]:
        return
    low, high = ends
    step = 10.0 ** math.floor(math.log10((high - low) / MOST_STEPS))
    step *= next(factor for factor in (1, 2, 2.5, 5, 10) if (high - low) / (factor * step) <= MOST_STEPS)
    for n in range(math.floor(low / step) + 1, math.ceil(high / step)):
        yield round(n * step, 12 - math.floor(math.log10(step)))


def _measures(volume: Any, isovalue: float, cells: int) -> dict[str, Any]:
    """Return the measures of the surface at an isovalue."""
    try:
        surface = extract_surface(volume, SurfaceSettings(isovalue=isovalue))
    except EmptySurfaceError:  # beyond what the type of the values holds
        return {"active_cells": 0, "active_percent": 0.0, "area_mm2": 0.0, "components": 0}
    active = surface.counts.active_cells or 0
    return {
        "active_cells": active,
        "active_percent": 100.0 * active / cells if cells else 0.0,
        "area_mm2": measure_quality(surface.mesh).area,
        "components": measure_topology(surface.mesh).components,
    }
