"""How much memory a conversion needs, told before it is taken."""

import os

from dmc_cli.errors import MemoryBudgetError
from dmc_cli.settings import ConvertSettings
from dmc_cli.volume.allocation import available_bytes
from dmc_cli.volume.mapping import mapped_file
from dmc_cli.volume.volume import Volume

BITS_BYTES_A_NODE = 6 / 8
"""Inside, active and ordinary bits, bits of nodes with data, and two ranks a word."""

VERTEX_BYTES = 12 + 12 + 8 + 12
"""Position, local coordinates, cell and normal."""

QUAD_BYTES = 16

HALFEDGE_NODE_BYTES = 1 / 2
"""The quads' ranks: three bits a node and a number a word."""

HALFEDGE_VERTEX_BYTES = 4 + 4 + 1
"""A halfedge, the valence, and whether the vertex has gone."""

HALFEDGE_QUAD_BYTES = 16 + 1 + 1 + 1 + 2 + 8
"""Twins, defect, whether the quad has gone and may go, two colours; lists of quads with a pattern."""

RELAX_VERTEX_BYTES = 12 + 19
RELAX_SPARE_BYTES = 12 + 8 + 12 + 12
RELAX_QUAD_BYTES = 4 + 1
"""Of a vertex a normal, where a step aims and whether it may go there; of each of two spares all of a vertex
and its normal; of a quad its shape and whether it fails."""


def reserve_values(nodes: int, value_bytes: int, settings: ConvertSettings) -> None:
    """Raise MemoryBudgetError unless a volume fits, before its values are read."""
    _reserve(value_bytes + int(BITS_BYTES_A_NODE * nodes), settings, "the volume and its cells")
    jobs = settings.share.jobs
    available = available_bytes() if jobs == 1 else settings.share.free
    if settings.output.memory is None and available is not None and value_bytes > available // jobs:
        raise MemoryBudgetError(
            f"the volume needs {_readable(value_bytes)}, but {_readable(available)} of memory are free"
            f"{_for_each(available, jobs)}; end other programs, {_fewer(jobs)}crop or downsample the volume,"
            " or force it with --memory"
        )


def reserve_cells(volume: Volume, settings: ConvertSettings) -> None:
    """Raise MemoryBudgetError unless the bits of the volume's nodes and cells fit."""
    _reserve(_node_bytes(volume), settings, "the volume and its cells")


def reserve_mesh(vertices: int, quads: int, volume: Volume, settings: ConvertSettings) -> None:
    """Raise MemoryBudgetError unless the mesh fits beside the volume; called before it is made."""
    needed = _node_bytes(volume) + vertices * VERTEX_BYTES + quads * QUAD_BYTES
    steps = settings.mesh.relax
    if settings.needs_halfedges:
        needed += int(HALFEDGE_NODE_BYTES * volume.values.size)
        needed += vertices * HALFEDGE_VERTEX_BYTES + quads * HALFEDGE_QUAD_BYTES
    if steps:
        needed += vertices * (RELAX_VERTEX_BYTES + min(steps, 2) * RELAX_SPARE_BYTES)
        needed += quads * RELAX_QUAD_BYTES
    _reserve(needed, settings, f"the volume and a mesh of {quads} quads")


def _node_bytes(volume: Volume) -> int:
    """Bytes of the volume's values, unless a file holds them, and of the bits of its nodes."""
    held = 0 if mapped_file(volume.values) is not None else volume.values.nbytes
    return held + int(BITS_BYTES_A_NODE * volume.values.size)


def _reserve(needed: int, settings: ConvertSettings, what: str) -> None:
    budget, jobs = settings.output.memory, settings.share.jobs
    if budget is not None and needed > budget // jobs:
        each = f"{_readable(budget // jobs)} that each of {jobs} jobs has of the " if jobs > 1 else ""
        raise MemoryBudgetError(
            f"{what} need {_readable(needed)}, more than the {each}{_readable(budget)} of --memory; raise it,"
            f" {_fewer(jobs)}or crop or downsample the volume"
        )
    present = total_memory()
    if budget is None and present is not None and needed > present // jobs:
        raise MemoryBudgetError(
            f"{what} need {_readable(needed)}, but this machine has {_readable(present)} of memory"
            f"{_for_each(present, jobs)}; {_fewer(jobs)}crop or downsample the volume, or force it with"
            " --memory"
        )


def _for_each(size: int, jobs: int) -> str:
    """What a job has of memory that several share."""
    return f", {_readable(size // jobs)} for each of {jobs} jobs" if jobs > 1 else ""


def _fewer(jobs: int) -> str:
    """What may help where several jobs share the memory."""
    return "take fewer --jobs, " if jobs > 1 else ""


def total_memory() -> int | None:
    """Return the machine's memory in bytes, or None where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None


def _readable(size: int) -> str:
    return f"{size / 2**30:.2f} GiB" if size >= 2**28 else f"{size / 2**20:.1f} MiB"
