"""List what stands beside each vertex or face in a file (`--values`)."""

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np

from dmc_cli.mesh import Mesh, Placement, connect
from dmc_cli.progress import Stopwatch
from dmc_cli.settings import FACE_VALUES, MeshValue
from dmc_cli.volume import Volume


def value_kernels(names: Sequence[MeshValue]) -> list[ModuleType]:
    """Return the modules whose kernels list these values."""
    if not names:
        return []
    from dmc_cli.measures import list_kernels, thickness_kernels

    return list_kernels() + (thickness_kernels() if "thickness" in names else [])


def list_values(
    names: Sequence[MeshValue],
    mesh: Mesh,
    placement: Placement | None,
    volume: Volume | None,
    watch: Stopwatch,
) -> dict[str, dict[str, Any]]:
    """Return values of vertices and of faces as `MeshFile` takes them.

    Args:
        names: Which ones.
        mesh: The mesh as it is written: lengths are in its unit.
        placement: Where its vertices lie, and the volume of its surface, for the deviation alone.
        volume: That volume.
        watch: Times the stage.
    """
    if not names:
        return {}
    with watch.stage("values", "listing values"):
        found = {name: _listed(name, mesh, placement, volume) for name in names}
    return {
        "vertex_values": {name: found[name] for name in names if name not in FACE_VALUES},
        "face_values": {name: found[name] for name in names if name in FACE_VALUES},
    }


def _listed(name: MeshValue, mesh: Mesh, placement: Placement | None, volume: Volume | None) -> Any:
    """Return a value of each vertex or face."""
    from dmc_cli.measures import list_deviation, list_shapes, list_thickness

    match name:
        case "quality":
            return list_shapes(mesh)
        case "deviation":
            assert placement is not None
            assert volume is not None
            return list_deviation(placement, volume).astype(np.float32)
        case "valence":
            return connect(mesh).require_halfedges().valence.numpy()
        case "thickness":
            return list_thickness(mesh).astype(np.float32)
