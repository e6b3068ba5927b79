"""Join the meshes of a scene to one of groups, with the normals and values that all of them have."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array, Float64Array
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.grouping import Grouping
from dmc_cli.mesh_io.parsed import usable_values
from dmc_cli.volume import Color


@dataclass(frozen=True)
class Piece:
    """A mesh of a scene.

    Attributes:
        points: Positions, (V, 3), where the scene has them.
        counts: Corners of each face, (F,).
        corners: Vertices of all faces in a row, from 0.
        normals: Of the vertices, (V, 3) float32, of length 1; or None.
        vertex_values: Arrays by name, a row a vertex.
        face_values: Likewise of faces.
        name: Of the part that it is.
        part: The same for pieces of one part; None if it is one of its own.
        color: Its colour, or None.
    """

    points: AnyArray
    counts: AnyArray
    corners: AnyArray
    normals: Float32Array | None = None
    vertex_values: dict[str, AnyArray] = field(default_factory=dict)
    face_values: dict[str, AnyArray] = field(default_factory=dict)
    name: str = ""
    part: tuple[int, int] | None = None
    color: Color | None = None


def joined(path: str, pieces: Sequence[Piece], told: set[str]) -> dict[str, Any]:
    """Return what `make_mesh` takes but for the path; what only some pieces have is added to what is told.

    Raises:
        MeshFileError: A piece's faces have not as many corners as they count, or one is no vertex of it.
    """
    for piece in pieces:
        _check(path, piece)
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    normals = [piece.normals for piece in pieces if piece.normals is not None]
    if 0 < len(normals) < len(pieces):
        told.add("normals of some parts")
    unusable: list[str] = []
    found = {
        kind: usable_values(_of_all([getattr(piece, kind) for piece in pieces], told), unusable)
        for kind in ("vertex_values", "face_values")
    }
    told |= set(unusable)
    nothing = np.zeros(0, np.int64)
    shifted = [piece.corners + start for piece, start in zip(pieces, starts[:-1], strict=True)]
    return {
        "points": np.concatenate([np.zeros((0, 3)), *(piece.points for piece in pieces)]),
        "counts": np.concatenate([nothing, *(piece.counts for piece in pieces)]),
        "corners": np.concatenate([nothing, *shifted]),
        "normals": np.concatenate(normals) if normals and len(normals) == len(pieces) else None,
        "grouping": _grouping(pieces),
        **found,
    }


def _grouping(pieces: Sequence[Piece]) -> Grouping:
    """Return the parts of a scene as groups, in the order that they come in."""
    firsts: dict[object, int] = {}
    numbers = [
        firsts.setdefault(number if piece.part is None else piece.part, len(firsts))
        for number, piece in enumerate(pieces)
    ]
    owners = dict(zip(reversed(numbers), reversed(pieces), strict=True))
    colors = {number: piece.color for number, piece in owners.items() if piece.color is not None}
    return Grouping(
        names=[owners[number].name or f"part_{number + 1}" for number in range(len(firsts))],
        numbers=np.repeat(np.array(numbers, np.int64), [len(piece.counts) for piece in pieces]),
        colors=colors,
    )


def _check(path: str, piece: Piece) -> None:
    """Raise MeshFileError unless the faces are of this piece: else they would take a neighbour's vertices."""
    if (piece.counts < 0).any() or piece.counts.sum() != len(piece.corners):
        raise MeshFileError(
            f"{path}: {len(piece.corners)} corners of {len(piece.counts)} faces were found; expected"
            f" {int(piece.counts.sum())}, as many as the faces count; it is damaged"
        )
    outside = piece.corners[(piece.corners < 0) | (piece.corners >= len(piece.points))]
    if outside.size:
        raise MeshFileError(
            f"{path}: a face names vertex {outside[0]}; expected 0 to {len(piece.points) - 1}, since its mesh"
            f" has {len(piece.points)} vertices; it is damaged"
        )


def _of_all(tables: Sequence[dict[str, AnyArray]], told: set[str]) -> dict[str, AnyArray]:
    """Return the values that all tables have in one shape and type, one after the other."""
    found = {}
    for name in dict.fromkeys(name for table in tables for name in table):
        arrays = [table[name] for table in tables if name in table]
        kinds = {(array.shape[1:], array.dtype) for array in arrays}
        if len(arrays) == len(tables) and len(kinds) == 1:
            found[name] = np.concatenate(arrays)
        else:
            told.add(f"values {name} of some parts")
    return found


def turned_normals(normals: AnyArray, linear: Float64Array) -> Float32Array | None:
    """Return normals after a map of the points, length 1 again; None where one has no direction.

    Args:
        normals: Before it, (V, 3).
        linear: The map's part without the shift, (3, 3), of columns.
    """
    if not (np.isfinite(linear).all() and np.isfinite(normals).all()):
        return None
    with np.errstate(all="ignore"):
        moved = normals
        if not np.array_equal(linear, np.eye(3)):
            moved = normals.astype(np.float64) @ np.linalg.pinv(linear)
            moved /= np.linalg.norm(moved, axis=1)[:, None]
        found = moved.astype(np.float32)
    return found if np.isfinite(found).all() else None
