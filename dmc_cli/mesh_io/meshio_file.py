"""Read the triangles and quads of a file by meshio, with their values."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_formats import known_suffixes
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import make_mesh, unread, usable_values

FACES = ("triangle", "quad")
OTHER_FACES = ("triangle", "quad", "polygon")
"""How meshio calls the faces that are read, and how the names of all faces begin."""

HEAD = 2048
"""Characters of a file that may name the space and the unit in a comment."""


def read_with_meshio(path: Path, file_format: str | None = None) -> MeshFile:
    """Read the triangles and quads of any other format; triangles need not come where they were.

    Args:
        path: The file.
        file_format: How meshio calls its format; without it, the suffix tells.

    Raises:
        UnsupportedFormatError: There is no reader, or faces of another kind.
        MeshFileError: meshio cannot read it.
    """
    import warnings

    import meshio

    if file_format is None and path.suffix.lower() not in meshio.extension_to_filetypes:
        raise UnsupportedFormatError(
            f"{path}: there is no reader for {path.suffix or 'a file without a suffix'}; expected"
            f" {', '.join(known_suffixes())} or a format of meshio such as .med, .vol, .su2"
        )
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            mesh = meshio.read(path, file_format)
        points = np.zeros((len(mesh.points), 3))
        points[:, : mesh.points.shape[1]] = mesh.points
        blocks: list[Any] = [np.asarray(block.data) for block in mesh.cells if block.type in FACES]
        corners = [block.ravel().astype(np.int64) for block in blocks]
        face_data = {
            name: np.concatenate(_of_faces(mesh, data)) for name, data in mesh.cell_data.items() if blocks
        }
    except (Exception, SystemExit) as error:
        raise MeshFileError(f"{path}: meshio cannot read it: {error}") from error
    odd = [block for block in mesh.cells if block.type.startswith(OTHER_FACES) and block.type not in FACES]
    if odd:
        raise UnsupportedFormatError(
            f"{path}: {len(odd[0].data)} faces of the kind {odd[0].type} found; expected triangles and "
            "quads; triangulate other faces"
        )
    told = [f"{len(block.data)} cells of {block.type}" for block in mesh.cells if block.type not in FACES]
    counts = [np.full(len(block), block.shape[1]) for block in blocks]
    empty = np.zeros(0, dtype=np.int64)
    found = np.concatenate([empty, *counts]), np.concatenate([empty, *corners])
    vertex_values = _values(mesh.point_data, len(points), told)
    face_values = _values(face_data, len(found[0]), told)
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    return make_mesh(
        str(path),
        points,
        *found,
        head,
        vertex_values=vertex_values,
        face_values=face_values,
        warnings=unread(path, told),
    )


def _of_faces(mesh: Any, data: Any) -> list[Any]:
    """Return the values of the blocks of faces among those of all blocks."""
    return [np.asarray(part) for block, part in zip(mesh.cells, data, strict=True) if block.type in FACES]


def _values(data: Mapping[str, Any], count: int, told: list[str]) -> dict[str, AnyArray]:
    """Return what meshio reads as values; numbers of parts, whose names have a colon, are passed over."""
    arrays = {name: np.asarray(array) for name, array in data.items() if ":" not in name}
    told += [f"values {name}" for name, array in arrays.items() if len(array) != count]
    return usable_values({name: array for name, array in arrays.items() if len(array) == count}, told)
