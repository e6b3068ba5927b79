"""Read a mesh by the suffix of its file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_formats import FORMATS, function, known_suffixes
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.volume_io import exists

FACES = ("triangle", "quad")
OTHER_FACES = ("triangle", "quad", "polygon")
"""How meshio calls the faces that are read, and how the names of all faces begin."""


def read_mesh(path: str | Path) -> MeshFile:
    """Read a mesh of quads and triangles.

    Args:
        path: A .ply, .obj or .off file, or one of a format that meshio knows, for example .vtk, .vtu, .stl.

    Raises:
        UnsupportedFormatError: No reader for this suffix or this variant.
        MeshFileError: The file is missing, damaged or has no faces.
    """
    file = Path(path)
    if not exists(file) or not file.is_file():
        raise MeshFileError(f"{path}: no such file was found; expected a mesh")
    mesh = _reader(file.suffix.lower())(file)
    if not len(mesh.faces):
        raise MeshFileError(
            f"{path}: {len(mesh.points)} vertices and no faces were found; expected a surface mesh"
        )
    return mesh


def _reader(suffix: str) -> Callable[[Path], MeshFile]:
    """Return our reader of files with a suffix, or meshio."""
    ours = next((known for known in FORMATS.values() if known.suffix == suffix), None)
    return _read_with_meshio if ours is None else function(ours.read)


def _read_with_meshio(path: Path) -> MeshFile:
    """Read the triangles and quads of any other format.

    Raises:
        UnsupportedFormatError: There is no reader, or faces of another kind.
        MeshFileError: meshio cannot read it.
    """
    import warnings

    import meshio

    if path.suffix.lower() not in meshio.extension_to_filetypes:
        raise UnsupportedFormatError(
            f"{path}: there is no reader for {path.suffix or 'a file without a suffix'}; expected"
            f" {', '.join(known_suffixes())} or a format of meshio such as .vtk, .vtu, .stl"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = meshio.read(path)
        points = np.zeros((len(mesh.points), 3))
        points[:, : mesh.points.shape[1]] = mesh.points
    except (Exception, SystemExit) as error:
        raise MeshFileError(f"{path}: meshio cannot read it: {error}") from error
    odd = [block for block in mesh.cells if block.type.startswith(OTHER_FACES) and block.type not in FACES]
    if odd:
        raise UnsupportedFormatError(
            f"{path}: {len(odd[0].data)} faces of the kind {odd[0].type} found; expected triangles and "
            "quads; triangulate other faces"
        )
    cells = [f"{len(block.data)} cells of {block.type}" for block in mesh.cells if block.type not in FACES]
    values = [f"values {name}" for name in (*mesh.point_data, *mesh.cell_data)]
    blocks: list[Any] = [block.data for block in mesh.cells if block.type in FACES]
    counts = [np.full(len(block), block.shape[1]) for block in blocks]
    empty = np.zeros(0, dtype=np.int64)
    corners = [block.ravel().astype(np.int64) for block in blocks]
    told = unread(path, [*cells, *values])
    found = np.concatenate([empty, *counts]), np.concatenate([empty, *corners])
    return make_mesh(str(path), points, *found, warnings=told)
