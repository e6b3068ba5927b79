"""Hold where the vertices of a mesh lie on the surface, and compute their positions in the output space."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Float32Array, Float64Array
from dmc_cli.errors import CallError, MeshInvariantError
from dmc_cli.field import GridShape, kernel_matrix, map_vertices
from dmc_cli.mesh.array_checks import check_array
from dmc_cli.runtime import Device


@dataclass(frozen=True)
class SurfaceFrame:
    """The surface that vertices lie on: a field's zero, and its grid's map to the output space.

    Attributes:
        field: The kernels' `Field`: F at the grid's nodes.
        grid: The grid, with the virtual border if closed.
        affine: Shape (4, 4): the grid's node index, slices even, to the output space.
        depths: Depths of unevenly spaced slices, float64 (nz,), as `slice_depths` returns them; else empty.
        sense: 1 if faces look along the gradient of F in the output space, else -1.
        device: Where the arrays are.
    """

    field: Any
    grid: GridShape
    affine: Float64Array
    depths: Any
    sense: float
    device: Device

    @property
    def stored_isovalue(self) -> float:
        """Return the level that was cut, in stored values."""
        return float(self.field.isovalue)


@dataclass(frozen=True)
class Placement:
    """Where each vertex lies: a cell, and local coordinates in it.

    Attributes:
        cell: int64 (V,), linear number of the cell's lowest node in the grid, x fastest.
        local: float32 vec3 (V,), coordinates in the cell, in [0, 1].
        frame: The surface that they lie on.

    Raises:
        CallError: An array is not of its type and length, contiguous and on the frame's device.
    """

    cell: Any
    local: Any
    frame: SurfaceFrame

    def __post_init__(self) -> None:
        """Refuse arrays that kernels could not read."""
        check_array("cells", self.cell, wp.int64, None, self.frame.device)
        check_array("local coordinates", self.local, wp.vec3, self.cell.shape[0], self.frame.device)

    def positions(self) -> Any:
        """Return the positions in the output space, float32 vec3 (V,), each rounded once."""
        frame = self.frame
        matrix = kernel_matrix(frame.affine)
        return map_vertices(self.cell, self.local, frame.depths, frame.grid, matrix, frame.device)

    def in_frame(self, affine: Float64Array) -> "Placement":
        """Return the same places with another map from the grid to the output space."""
        return replace(self, frame=replace(self.frame, affine=affine))


def require_placement(placement: Placement) -> Placement:
    """Return the placement; raise CallError if it is none."""
    if not isinstance(placement, Placement):
        raise CallError(
            f"a {type(placement).__name__} was found; expected a Placement, as extract_surface and the"
            " stages return beside the mesh; pass that"
        )
    return placement


def refuse_lost(local: Float32Array) -> None:
    """Raise MeshInvariantError with the first vertex whose local coordinates, (V, 3), are not in [0, 1]."""
    is_lost = ~((local >= 0) & (local <= 1)).all(axis=1)
    if is_lost.any():
        first = int(np.argmax(is_lost))
        found = ", ".join(f"{x:g}" for x in local[first].tolist())
        raise MeshInvariantError(
            f"vertex {first} lies at ({found}) of its cell, one of {int(is_lost.sum())} outside theirs;"
            " expected local coordinates from 0 to 1; please report this"
        )
