"""Allocate memory for a volume's values: asked for once, and refused where it cannot fit."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MemoryBudgetError
from dmc_cli.memory_limits import available_memory

Forecast = Callable[[tuple[int, int, int], int], None]
"""Takes nodes along x, y, z and the bytes of their values; raises MemoryBudgetError if that is too much."""

_forecast: ContextVar[Forecast | None] = ContextVar("forecast", default=None)


@contextmanager
def forecasting(forecast: Forecast) -> Iterator[None]:
    """Ask `forecast` before any values are allocated, instead of what memory is free, while this is open."""
    token = _forecast.set(forecast)
    try:
        yield
    finally:
        _forecast.reset(token)


def available_bytes() -> int | None:
    """Return the bytes that this process can still have, or None where the system does not tell."""
    found = available_memory()
    return None if found is None else found.size


def allocate_values(name: str, shape: tuple[int, int, int], dtype: np.dtype[Any] | type) -> AnyArray:
    """Return an unset array in native byte order, shape (nz, ny, nx).

    Args:
        name: The input, for the message.
        shape: Nodes along x, y, z.
        dtype: Type of a value; its byte order is ignored.

    Raises:
        MemoryBudgetError: The values do not fit into the memory that is free, or the run's into its budget.
    """
    native = np.dtype(dtype).newbyteorder("=")
    needed = math.prod(shape) * native.itemsize
    forecast = _forecast.get()
    if forecast is not None:
        forecast(shape, needed)
    available = available_bytes()
    message = (
        f"{name}: {needed / 2**20:,.0f} MiB needed for {' x '.join(map(str, shape))} values of {native}; "
        f"{(available or 0) / 2**20:,.0f} MiB of memory are free; use a smaller volume or a larger machine"
    )
    if forecast is None and available is not None and needed > available:
        raise MemoryBudgetError(message)
    try:
        return np.empty(shape[::-1], native)
    except (MemoryError, ValueError) as error:
        raise MemoryBudgetError(message) from error
