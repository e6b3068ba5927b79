"""Hold what goes into a mesh file, whatever its format."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from dmc_cli.errors import MeshInvariantError

Float32Array = np.ndarray[Any, np.dtype[np.float32]]
Int32Array = np.ndarray[Any, np.dtype[np.int32]]


@dataclass(frozen=True, kw_only=True)
class MeshFile:
    """A quad mesh in the coordinates of its file.

    Attributes:
        vertices: Positions, shape (V, 3), millimetres in `space`; all finite.
        quads: Corners of each quad, shape (Q, 4), vertex indices from 0, anticlockwise seen from
            where the normal points.
        normals: Unit normals of the vertices, shape (V, 3), or None.
        space: The axes that the coordinates are in; none where the input told no orientation, and
            for grid coordinates.
    """

    vertices: Float32Array
    quads: Int32Array
    normals: Float32Array | None = None
    space: Literal["RAS", "LPS", "none"] = "none"

    def __post_init__(self) -> None:
        """Refuse what no format could hold; a stage before this one is at fault."""
        _check_rows("vertices", self.vertices, 3, np.float32)
        _check_rows("quads", self.quads, 4, np.int32)
        _check_finite("vertices", self.vertices)
        count = len(self.vertices)
        if self.quads.size and not (self.quads.min() >= 0 and self.quads.max() < count):
            bad = int(np.flatnonzero(((self.quads < 0) | (self.quads >= count)).any(axis=1))[0])
            raise MeshInvariantError(
                f"quad {bad} names a vertex outside 0 to {count - 1}; please report this"
            )
        if self.normals is not None:
            _check_rows("normals", self.normals, 3, np.float32)
            _check_finite("normals", self.normals)
            if len(self.normals) != count:
                raise MeshInvariantError(
                    f"{len(self.normals)} normals for {count} vertices; please report this"
                )


def _check_rows(name: str, array: np.ndarray[Any, Any], columns: int, dtype: type[np.generic]) -> None:
    """Raise unless the array is a table of so many columns of this type."""
    if array.ndim != 2 or array.shape[1] != columns or array.dtype != dtype:
        raise MeshInvariantError(
            f"{name} are {array.dtype} of shape {array.shape}; expected {np.dtype(dtype)} of shape "
            f"(n, {columns}); please report this"
        )


def _check_finite(name: str, array: Float32Array) -> None:
    """Raise on the first row with NaN or infinity: no mesh format can hold them."""
    finite = np.isfinite(array)
    if not finite.all():
        bad = int(np.flatnonzero(~finite.all(axis=1))[0])
        raise MeshInvariantError(f"row {bad} of the {name} is not finite: {array[bad]}; please report this")
