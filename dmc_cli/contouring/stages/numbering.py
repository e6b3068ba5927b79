"""Hold the numbers of vertices and quads along the grid, by which halfedges and colours are found."""

from dataclasses import dataclass
from typing import Any

from dmc_cli.contouring.surface import Surface
from dmc_cli.errors import CallError


@dataclass(frozen=True)
class QuadNumbering:
    """Numbers of vertices and quads, as ranks.

    Attributes:
        cells: Active cells and their numbers; its `bits` are the kernels' `CellBits`.
        quad_starts: Quads before each block of words (`words.py`), int64, one item more than blocks.
        quad_count: Quads.
        is_reversed: Whether normals point towards the inside nodes.
        quad_words: The quads' ranks, as `rank_quads` returns them; None before the faces are connected.
    """

    cells: Any
    quad_starts: Any
    quad_count: int
    is_reversed: bool
    quad_words: Any | None = None


def numbering_of(surface: Surface, *, is_connected: bool = False) -> Any:
    """Return the numbering of a surface, as its method has it.

    Args:
        surface: The surface, its mesh as it was extracted.
        is_connected: Whether its quads must be connected by it.

    Raises:
        CallError: The mesh has other quads by now, or they are not connected.
    """
    numbering = surface.numbering
    if surface.mesh.face_count != numbering.quad_count:
        raise CallError(
            f"the mesh has {surface.mesh.face_count} faces; expected the {numbering.quad_count} that were"
            " extracted; call connect_faces and color_faces before the mesh is changed"
        )
    if is_connected and (numbering.quad_words is None or surface.mesh.halfedges is None):
        raise CallError(
            "the surface's faces are not connected along its grid; call connect_faces(surface) first"
        )
    return numbering
