"""Read a mesh by the suffix of its file."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_formats import FORMATS, function
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.meshio_file import read_with_meshio
from dmc_cli.volume_io import exists


def read_mesh(path: str | Path) -> MeshFile:
    """Read a mesh of quads and triangles.

    Args:
        path: A file of a format of `mesh_formats.py`, or of one that meshio knows, for example .med.

    Raises:
        UnsupportedFormatError: No reader for this suffix or this variant.
        MeshFileError: The file is missing, damaged or has no faces.
    """
    file = Path(path)
    if not exists(file) or not file.is_file():
        raise MeshFileError(f"{path}: no such file was found; expected a mesh")
    with np.errstate(all="ignore"):  # what overflows in a damaged file is refused as a coordinate or a corner
        mesh = _reader(file.suffix.lower())(file)
    if not len(mesh.faces):
        raise MeshFileError(
            f"{path}: {len(mesh.points)} vertices and no faces were found; expected a surface mesh"
        )
    return mesh


def _reader(suffix: str) -> Callable[[Path], MeshFile]:
    """Return our reader of files with a suffix, or meshio."""
    ours = next((known for known in FORMATS.values() if suffix in known.suffixes), None)
    return read_with_meshio if ours is None else function(ours.read)
