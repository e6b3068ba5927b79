"""Make Warp arrays over memory that is there already: views of arrays, and arrays of NumPy's.

Warp documents neither that an array keeps what `_source` names, nor that the items of an array may overlap.
"""

from functools import cache
from typing import Any

import warp as wp

from dmc_cli.array_types import AnyArray


def view(array: Any, dtype: Any, shape: int | tuple[int, ...], skipped: int = 0, step: int = 0) -> Any:
    """Return a view of an array's memory as other items, which keeps the memory.

    Args:
        array: A contiguous Warp array.
        dtype: Type of the view's items.
        shape: Items along each axis.
        skipped: Bytes of the array before the view.
        step: Bytes from an item to the next one, for a view of one axis; fewer than an item has where items
            overlap. 0: the items lie one after the other.
    """
    strides = (step,) if step else None
    return array_over((array.ptr or 0) + skipped, array, dtype, shape, strides, array.device)


def adopt(values: AnyArray, dtype: Any) -> Any:
    """Return an array in the memory of contiguous NumPy values, which may be read-only; on CPU alone."""
    return array_over(values.ctypes.data, values, dtype, values.shape)


def array_over(
    address: int,
    owner: Any,
    dtype: Any,
    shape: int | tuple[int, ...],
    strides: tuple[int, ...] | None = None,
    device: Any = "cpu",
) -> Any:
    """Return an array at an address of memory that `owner` holds, and keep `owner` as long as it lives."""
    if strides is None and isinstance(shape, int):
        strides = (size_of(dtype),)  # Warp takes its time to find them
    array = wp.array(ptr=address, dtype=dtype, shape=shape, strides=strides, device=device, copy=False)
    array._source = owner
    return array


@cache
def size_of(dtype: Any) -> int:
    """Return the bytes of a scalar or vector type."""
    return int(wp.types.type_size_in_bytes(dtype))
