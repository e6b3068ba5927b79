"""Put a volume together from slices that have a slope and an intercept each."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import DamagedVolumeError
from dmc_cli.progress import Progress
from dmc_cli.volume import allocate_values, storable_type


def stack_slices(
    name: str,
    shape: tuple[int, int, int],
    dtype: np.dtype[Any],
    scales: Float64Array,
    slabs: Iterable[AnyArray],
    progress: Progress,
) -> tuple[AnyArray, float, float]:
    """Return values, shape (nz, ny, nx), and the slope and intercept of them all.

    Where all slices have the same of both, values stay in the type that they are stored in. Else they become
    physical ones: float32 for integers of 8 and 16 bits, which it holds, float64 for others.

    Args:
        name: The input, for messages.
        shape: Nodes along x, y, z.
        dtype: Type of a stored value; its byte order is ignored.
        scales: Shape (nz, 2): slope and intercept of each slice.
        slabs: Stored values, shape (any, ny, nx) each, one after the other.
        progress: Who is told how far it is.

    Raises:
        UnsupportedFormatError: Values of a type that no volume holds.
        DamagedVolumeError: A slope or an intercept that cannot be.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    stored = storable_type(name, dtype)
    if not np.isfinite(scales).all():
        k = int(np.argmin(np.isfinite(scales).all(axis=1)))
        raise DamagedVolumeError(
            f"{name}: slope {scales[k, 0]:g} and intercept {scales[k, 1]:g} of slice {k} found; expected "
            "finite numbers; the header is damaged"
        )
    is_one = bool((scales == scales[0]).all())
    physical = np.dtype(np.float32 if stored.itemsize <= 2 else np.float64)
    values = allocate_values(name, shape, stored if is_one else physical)
    done = 0
    for slab in slabs:
        for plane in slab:
            slope, intercept = scales[done]
            values[done] = plane if is_one else plane * slope + intercept
            done += 1
        progress.advance(done / shape[2])
    return values, *(scales[0].tolist() if is_one else (1.0, 0.0))  # type: ignore[return-value]
