"""How much memory a conversion needs, told before it is taken."""

import os

import numpy as np

from dmc_cli.errors import MemoryBudgetError
from dmc_cli.settings import ConvertSettings
from dmc_cli.volume.volume import Volume

BITS_BYTES_A_NODE = 5 / 8
"""Inside, active and ordinary bits, bits of nodes with data, and a rank a word."""

VERTEX_BYTES = 12 + 12 + 8 + 12
"""Position, local coordinates, cell and normal."""

QUAD_BYTES = 16


def reserve_cells(volume: Volume, settings: ConvertSettings) -> None:
    """Raise MemoryBudgetError unless the bits of the volume's nodes and cells fit."""
    _reserve(_node_bytes(volume), settings, "the volume and its cells")


def reserve_mesh(vertices: int, quads: int, volume: Volume, settings: ConvertSettings) -> None:
    """Raise MemoryBudgetError unless the mesh fits beside the volume; called before it is made."""
    needed = _node_bytes(volume) + vertices * VERTEX_BYTES + quads * QUAD_BYTES
    _reserve(needed, settings, f"the volume and a mesh of {quads} quads")


def _node_bytes(volume: Volume) -> int:
    """Bytes of the volume's values, unless a file holds them, and of the bits of its nodes."""
    held = 0 if isinstance(volume.values, np.memmap) else volume.values.nbytes
    return held + int(BITS_BYTES_A_NODE * volume.values.size)


def _reserve(needed: int, settings: ConvertSettings, what: str) -> None:
    budget = settings.output.memory
    if budget is not None and needed > budget:
        raise MemoryBudgetError(
            f"{what} need {_readable(needed)}, more than the {_readable(budget)} of --memory; raise it, or"
            " crop or downsample the volume"
        )
    present = total_memory()
    if budget is None and present is not None and needed > present:
        raise MemoryBudgetError(
            f"{what} need {_readable(needed)}, but this machine has {_readable(present)} of memory; crop or"
            " downsample the volume, or force it with --memory"
        )


def total_memory() -> int | None:
    """Return the machine's memory in bytes, or None where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None


def _readable(size: int) -> str:
    return f"{size / 2**30:.2f} GiB" if size >= 2**28 else f"{size / 2**20:.1f} MiB"
