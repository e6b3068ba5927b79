"""Write a mesh to a file of any format: the one way to write."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePath

from dmc_cli.errors import CallError, SettingsError
from dmc_cli.files import write_output
from dmc_cli.mesh_formats import FORMATS, MeshFormat, function, known_suffixes
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.notices import Notice
from dmc_cli.settings import STREAM


@dataclass(frozen=True)
class WrittenFile:
    """What was written: the format, the number of bytes, and what is told of what was left out."""

    path: str
    format: str
    size: int
    warnings: tuple[Notice, ...] = ()


def choose_format(path: str, output_format: str | None = None) -> str:
    """Return the format asked for, else the one that the suffix tells.

    Raises:
        SettingsError: The suffix is of no format, or there is none.
    """
    if output_format is not None:
        return output_format
    suffix = PurePath(path).suffix.lower()
    for name, mesh_format in FORMATS.items():
        if suffix == mesh_format.suffix:
            return name
    known = ", ".join(known_suffixes())
    if path == STREAM:
        raise SettingsError("standard output has no suffix; name the format with --output-format")
    found = f"the suffix {suffix}" if suffix else "no suffix"
    raise SettingsError(
        f"{path} has {found}; expected one of {known}; rename the output, or name its format with "
        "--output-format"
    )


def write_mesh(
    path: str,
    mesh: MeshFile,
    *,
    output_format: str | None = None,
    ascii: bool = False,
    force: bool = False,
) -> WrittenFile:
    """Write a mesh completely or not at all.

    Args:
        path: The file, or `-` for standard output.
        mesh: What to write.
        output_format: Which format; without it the suffix of `path` tells.
        ascii: Text where the format could be binary too.
        force: Replace a file that exists.

    Raises:
        SettingsError: The format is not known.
        CallError: It is no `MeshFile`, or has values that the format cannot name.
        WriteError: The file exists, or it cannot be written; an older file is untouched.
    """
    if not isinstance(mesh, MeshFile):
        raise CallError(
            f"a {type(mesh).__name__} was found; expected a MeshFile; make one with file_of_mesh(mesh) first"
        )
    name = choose_format(path, output_format)
    size = write_output(path, function(FORMATS[name].encode)(mesh, ascii=ascii), force=force)
    return WrittenFile(path, name, size, tuple(_left_out(mesh, FORMATS[name])))


def _left_out(mesh: MeshFile, mesh_format: MeshFormat) -> Iterator[Notice]:
    """Yield a warning of each thing that the format cannot hold."""
    if mesh.normals is not None and not mesh_format.holds_normals:
        yield Notice("W-NORMALS-LEFT-OUT", f"{mesh_format.title} files hold no normals: they were left out")
    names = [*mesh.vertex_values, *mesh.face_values]
    if names and not mesh_format.holds_values:
        told = f"{mesh_format.title} files hold no values of vertices and faces; left out: {', '.join(names)}"
        yield Notice("W-VALUES-LEFT-OUT", told)
