"""Make what every method's surface has beside its mesh: the field, the faces' direction."""

from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.stages.classification import InsideBits
from dmc_cli.errors import VolumeError
from dmc_cli.field import DeviceVolume, GridShape, is_mirrored, make_field, nodata_value
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import FARTHEST_MM


def field_of(volume: DeviceVolume, settings: SurfaceSettings, nodes: InsideBits) -> Any:
    """Return the kernels' `Field`, which looks for nodes without data only where there are any."""
    field = make_field(volume, settings)
    if nodes.no_data_count:
        field.has_nodata = 1
        field.nodata = nodata_value(volume.volume, field)
    return field


def refuse_infinite(position: Any, to_output: Float64Array, grid: GridShape, depths: Any) -> None:
    """Raise VolumeError if a position is beyond float32; positions are only looked at where one may be."""
    rows = to_output[:3].tolist()
    deepest = np.abs(depths.numpy()).max(initial=grid.nz)
    sizes = (grid.nx, grid.ny, float(deepest), 1)
    farthest = max(sum(abs(a) * n for a, n in zip(row, sizes, strict=True)) for row in rows)
    if farthest < FARTHEST_MM or np.isfinite(position.numpy()).all():
        return
    raise VolumeError(
        f"the volume reaches as far as {farthest:g} mm; expected coordinates that float32 holds, up to"
        f" {FARTHEST_MM:.2g}; move its origin, or write grid coordinates with --space voxel"
    )


def faces_reversed(settings: SurfaceSettings, affine: Float64Array) -> bool:
    """Return whether quads made for a right-handed grid, normals towards lower values, must be reversed."""
    towards_higher = settings.orientation == "gradient" or settings.inside == "below"
    return towards_higher != is_mirrored(affine)
