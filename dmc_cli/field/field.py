"""Hold the scalar field whose zero set is the surface: stored values less the stored isovalue.

Values stay as they are stored; slope and intercept move the isovalue instead. The field is
F = s (value - stored isovalue) with s = -1 for a negative slope, so inside is F >= 0 whatever the slope.

Conventions:
    - Integer values: an integer stored isovalue v becomes v - 0.5 (negative slope: v + 0.5), which has the
      same inside set and leaves no node on the surface. Floating-point values: v is rounded to their type.
    - Closed border: a virtual node mirrors its nearest node to the other side of the isovalue, so caps are
      flat and lie half a cell outside the last nodes. The virtual layer is never part of the object.
    - No data (NaN, infinity, padding): with an open border a cell with such a corner does not exist; with
      a closed border such a node is not part of the object and has the volume's extreme value.
    - Beyond `FARTHEST` F stays there, so that differences of F are numbers whatever the values are.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import EmptySurfaceError
from dmc_cli.field.brick_ranges import BrickRanges
from dmc_cli.field.grid import Grid
from dmc_cli.field.sample_reader import KINDS, STORED_TYPES, cell_at, value_at
from dmc_cli.field.trilinear import CornerValues64
from dmc_cli.runtime import Device, adopt, view
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

FARTHEST = 2.0**1020
"""Largest |F|: an eighth of what float64 holds."""


@wp.struct
class Field:
    """Stored values and how to read them as F.

    `values` are the volume's own, as bytes [row, byte]; `kind` says which type they have
    (`sample_reader.py`). `padding_low` and `padding_high` bound the stored values that mean no data (low >
    high: there are none). `outside` is the sign of F at virtual nodes. `least` is |F| of a virtual node whose
    nearest node lies on the isovalue: the step to the next number, or 0 where that counts as outside the
    object. `has_nodata` is 1 if there are nodes without data; `nodata` is their F under a closed border,
    where they count as nodes outside the object (with an open border no cell has such a corner).
    """

    values: wp.array2d(dtype=wp.uint8)
    kind: wp.int32
    isovalue: wp.float64
    sign: wp.float64
    outside: wp.float64
    least: wp.float64
    has_nodata: wp.int32
    nodata: wp.float64
    padding_low: wp.float64
    padding_high: wp.float64


@dataclass
class VolumeIndex:
    """What the first surface of a volume leaves for those at other isovalues.

    Attributes:
        ranges: The ranges of bricks of stored values; None before the first pass over them.
        no_data_count: Number of nodes without data.
        data: The bits of nodes with data where the border is open, uint32 [row, word]; None before they are
            asked for.
    """

    ranges: BrickRanges | None = None
    no_data_count: int = 0
    data: Any | None = None


@dataclass(frozen=True)
class DeviceVolume:
    """A volume's values on the device; the array keeps the memory alive.

    Attributes:
        values: Stored values [row, i], one of `STORED_TYPES`.
        volume: The volume itself, for its geometry and meaning.
        device: Where the values are.
        index: What is kept for further isovalues; None where there is one.
    """

    values: Any
    volume: Volume
    device: Device
    index: VolumeIndex | None = None

    @property
    def dtype(self) -> np.dtype[Any]:
        """Return the value type as NumPy names it."""
        return np.dtype(wp.dtype_to_numpy(self.values.dtype))

    @property
    def kind(self) -> int:
        """Return the tag of the value type."""
        return KINDS[self.dtype.name]

    @property
    def bytes(self) -> Any:
        """Return the stored values as bytes [row, byte]: the same memory, kept alive by the view."""
        values = self.values
        shape = (values.shape[0], values.shape[1] * self.dtype.itemsize)
        return view(values, wp.uint8, shape)


def upload_volume(volume: Volume, device: Device, *, indexed: bool = False) -> DeviceVolume:
    """Hand the stored values to the device: without a copy on CPU, by one copy on CUDA.

    `indexed` keeps an index of them, which surfaces at several isovalues share. 64-bit integers become 32-bit
    ones where they fit and float64 otherwise.
    """
    values = volume.values
    if values.dtype.kind in "iu" and values.dtype.itemsize == 8:
        values = _narrowed(values)
    values = np.ascontiguousarray(values)
    nz, ny, nx = values.shape
    flat = values.reshape(nz * ny, nx)
    dtype = STORED_TYPES[values.dtype.name]
    if device.is_cpu:
        # by pointer: a memory map is read-only, which NumPy's own door to Warp refuses
        array = adopt(flat, dtype)
    else:
        array = wp.array(flat, dtype=dtype, device=device.name)
    return DeviceVolume(array, volume, device, VolumeIndex() if indexed else None)


def _narrowed(values: AnyArray) -> AnyArray:
    """Return 64-bit integers in the first type of int32, uint32, float64 that holds their range."""
    low, high = int(values.min()), int(values.max())
    for dtype in (np.int32, np.uint32):
        limits = np.iinfo(dtype)
        if limits.min <= low and high <= limits.max:
            return values.astype(dtype)
    return values.astype(np.float64)


def stored_isovalue(volume: Volume, isovalue: float) -> float:
    """Return the isovalue to cut the stored values at, by the tie rules above.

    Raises:
        EmptySurfaceError: It is not a finite number of the values' type.
    """
    stored = (isovalue - volume.intercept) / volume.slope
    dtype = volume.values.dtype
    if dtype.kind == "f":
        with np.errstate(over="ignore"):
            stored = float(dtype.type(stored))
    if not math.isfinite(stored):
        raise EmptySurfaceError(
            f"there is no surface at isovalue {isovalue:g}: it is beyond every {dtype.name}"
            " number; choose an isovalue in the range that `dmc info` tells"
        )
    if dtype.kind in "iu" and stored == math.floor(stored):
        stored += 0.5 if volume.slope < 0 else -0.5
    return stored


def make_field(volume: DeviceVolume, settings: SurfaceSettings) -> Any:
    """Return the `Field` that kernels read, for one isovalue; nodes without data have no value yet."""
    field = Field()
    field.values, field.kind = volume.bytes, volume.kind
    source = volume.volume
    field.isovalue = stored_isovalue(source, settings.settled_isovalue)
    field.sign = -1.0 if source.slope < 0 else 1.0
    field.outside = -1.0 if settings.inside == "above" else 1.0
    field.least = _step_below(field.isovalue, volume.dtype) if settings.inside == "above" else 0.0
    field.padding_low, field.padding_high = padding_range(source)
    return field


def _step_below(isovalue: float, dtype: np.dtype[Any]) -> float:
    """Return the distance from the isovalue to the next lower number of the type (float64 for integers).

    The lowest number has the distance of the next higher one.
    """
    number = np.float32 if dtype == np.float32 else np.float64
    is_lowest = isovalue == float(np.finfo(number).min)
    following = np.nextafter(number(isovalue), number(math.inf if is_lowest else -math.inf))
    return abs(isovalue - float(following))


def padding_range(volume: Volume) -> tuple[float, float]:
    """Return the stored values that mean no data as a closed range; an empty one is (1, 0)."""
    return volume.padding if volume.padding is not None else (1.0, 0.0)


def nodata_value(volume: Volume, field: Any) -> float:
    """Return F of nodes without data under a closed border: the volume's extreme outside the object."""
    ends = volume.value_range()
    if ends is None:
        return float(field.outside)
    physical = ends[0] if field.outside < 0 else ends[1]
    stored = (physical - volume.intercept) / volume.slope
    distance = min(abs(stored - field.isovalue), FARTHEST)  # a physical value may be beyond every number
    return float(field.outside * max(distance, field.least))


@wp.func
def stored_value(field: Field, at: wp.int64) -> wp.float64:
    """Return the stored value of node `at` of the volume, x fastest."""
    return value_at(field.values, field.kind, at)


@wp.func
def node_of_volume(grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.int64:
    """Return the number, x fastest, of the volume's node (i, j, k); the grid's border does not count."""
    row = wp.int64(k) * wp.int64(grid.ny - 2 * grid.border) + wp.int64(j)
    return row * wp.int64(grid.nx - 2 * grid.border) + wp.int64(i)


@wp.func
def is_data(field: Field, value: wp.float64) -> wp.bool:
    """Return whether a stored value is data: finite and not padding."""
    return wp.isfinite(value) and (value < field.padding_low or value > field.padding_high)


@wp.func
def distance_to_isovalue(field: Field, value: wp.float64) -> wp.float64:
    """Return F of a stored value; a NaN stays one."""
    f = field.sign * (value - field.isovalue)
    f = wp.where(f > wp.float64(FARTHEST), wp.float64(FARTHEST), f)
    return wp.where(f < wp.float64(-FARTHEST), wp.float64(-FARTHEST), f)


@wp.func
def value_of_node(field: Field, border: wp.int32, value: wp.float64, is_virtual: wp.int32) -> wp.float64:
    """Return F at a node of the grid, given its stored value or that of the node nearest to a virtual one."""
    f = distance_to_isovalue(field, value)
    if border == 1 and field.has_nodata == 1 and not is_data(field, value):
        f = field.nodata
    return wp.where(is_virtual == 1, field.outside * wp.max(wp.abs(f), field.least), f)


@wp.func
def node_value(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.float64:
    """Return F at a node of the grid, virtual nodes and nodes without data included."""
    vx = wp.clamp(i - grid.border, 0, grid.nx - 1 - 2 * grid.border)
    vy = wp.clamp(j - grid.border, 0, grid.ny - 1 - 2 * grid.border)
    vz = wp.clamp(k - grid.border, 0, grid.nz - 1 - 2 * grid.border)
    value = stored_value(field, node_of_volume(grid, vx, vy, vz))
    is_virtual = vx + grid.border != i or vy + grid.border != j or vz + grid.border != k
    return value_of_node(field, grid.border, value, wp.where(is_virtual, 1, 0))


@wp.func
def needs_care(has_nodata: wp.int32, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether a corner of cell (i, j, k) may count for something else than what is stored."""
    at_border = i == 0 or j == 0 or k == 0 or i == grid.nx - 2 or j == grid.ny - 2 or k == grid.nz - 2
    return grid.border == 1 and (at_border or has_nodata == 1)


@wp.func
def careful_cell_values(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> CornerValues64:
    """Return F at the corners of any cell, node by node."""
    f = CornerValues64()
    for c in range(8):
        f[c] = node_value(field, grid, i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2))
    return f


@wp.func
def cell_values(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> CornerValues64:
    """Return F at the corners of cell (i, j, k) of the grid."""
    f = CornerValues64()
    if needs_care(field.has_nodata, grid, i, j, k):
        f = careful_cell_values(field, grid, i, j, k)
    else:
        b = grid.border
        row = wp.int64(grid.nx - 2 * b)
        layer = row * wp.int64(grid.ny - 2 * b)
        stored = cell_at(field.values, field.kind, node_of_volume(grid, i - b, j - b, k - b), row, layer)
        for c in range(8):
            f[c] = distance_to_isovalue(field, stored[c])
    return f
