"""Bring nodes to the other side of the isovalue: the one way in which a part is taken away or added.

A node's value is mirrored at the isovalue, as virtual nodes beyond a closed border are: between a flipped
node and another one the surface lies where both values put it. All other nodes keep their values, so every
crossed edge that stays is crossed where it was. What a type cannot hold becomes its least or greatest value.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, BoolArray
from dmc_cli.field import DeviceVolume, stored_isovalue, upload_volume
from dmc_cli.volume import Volume


def flipped_volume(volume: DeviceVolume, isovalue: float, values: AnyArray, bits: Any) -> DeviceVolume:
    """Return a volume with nodes flipped; `values`, its own or a copy, are changed. See `flip_nodes`."""
    flip_nodes(volume.volume, values, isovalue, bits)
    return upload_volume(replace(volume.volume, values=values, gradient=None, formula=None), volume.device)


def flip_nodes(volume: Volume, values: AnyArray, isovalue: float, bits: Any) -> int:
    """Mirror the values of nodes at the isovalue; return how many nodes there are.

    Args:
        volume: The volume, for what its values mean.
        values: Its values, [k, j, i], which are changed.
        isovalue: The isovalue, in physical values.
        bits: A bit for each node to flip, uint32 [row, word]; all of them have data.
    """
    cut = stored_isovalue(volume, isovalue)
    nz, ny, nx = values.shape
    layers = np.ascontiguousarray(bits).view(np.uint8).reshape(nz, ny, -1)
    count = 0
    for layer, plane in zip(layers, values, strict=True):
        if layer.any():
            flipped = np.unpackbits(layer, axis=1, count=nx, bitorder="little").astype(bool)
            plane[flipped] = _mirrored(plane[flipped], cut, is_low_inside=volume.slope < 0)
            count += int(np.count_nonzero(flipped))
    return count


def _mirrored(values: AnyArray, cut: float, *, is_low_inside: bool) -> AnyArray:
    """Return values on the other side of the stored isovalue, as far from it.

    A value on the isovalue is inside: the high side, or with a negative slope the low one.
    """
    exact = values.astype(np.float64)
    goes_down: BoolArray = exact > cut if is_low_inside else exact >= cut
    with np.errstate(over="ignore"):
        mirrored = 2.0 * cut - exact
    if values.dtype.kind in "iu":
        limits = np.iinfo(values.dtype)
        mirrored = np.where(goes_down, np.floor(mirrored), np.ceil(mirrored))
        return _whole(np.clip(mirrored, limits.min, limits.max), values.dtype)
    largest = float(np.finfo(values.dtype).max)
    found = np.clip(mirrored, -largest, largest).astype(values.dtype)
    level = values.dtype.type(cut)
    onwards = np.where(goes_down, -np.inf, np.inf).astype(values.dtype)
    stays = (found == level) & (goes_down != is_low_inside)
    return np.where(stays, np.nextafter(level, onwards), found)


def _whole(values: AnyArray, dtype: Any) -> AnyArray:
    """Return whole numbers as integers of a type; float64 rounds the greatest ones up beyond it."""
    limits = np.iinfo(dtype)
    found = values.astype(dtype) if dtype.itemsize < 8 else np.minimum(values, 2.0**53).astype(dtype)
    return np.clip(found, limits.min, limits.max)
