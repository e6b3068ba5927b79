"""Write a mesh to a file of any format: the one way to write."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from dmc_cli.errors import CallError, SettingsError
from dmc_cli.files import is_device, write_output, write_with_companion
from dmc_cli.mesh_formats import FORMATS, MeshFormat, format_by_suffix, function, known_suffixes
from dmc_cli.mesh_io.grouping import some_of
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.notices import Notice
from dmc_cli.settings import FACE_VALUES, STREAM, Element, MeshValue, OutputSpace, OutputUnit


@dataclass(frozen=True)
class WrittenFile:
    """What was written.

    Attributes:
        path: Where the mesh is.
        format: In which format.
        size: The number of its bytes.
        warnings: What is told of what was left out.
        companion: The file beside it that tells its colours, or None.
    """

    path: str
    format: str
    size: int
    warnings: tuple[Notice, ...] = ()
    companion: str | None = None


def choose_format(path: str, output_format: str | None = None) -> str:
    """Return the format asked for, else the one that the suffix tells.

    Raises:
        SettingsError: The suffix is of no format, or there is none.
    """
    name = output_format or format_by_suffix(path)
    if name is not None:
        return name
    known = ", ".join(known_suffixes())
    if path == STREAM:
        raise SettingsError("standard output has no suffix; name the format with --output-format")
    suffix = PurePath(path).suffix.lower()
    found = f"the suffix {suffix}" if suffix else "no suffix"
    raise SettingsError(
        f"{path} has {found}; expected one of {known}; rename the output, or name its format with "
        "--output-format"
    )


def check_encoding(name: str, *, ascii: bool, element: Element | None = None) -> None:
    """Raise SettingsError if text or a kind of element is asked for and the format has none."""
    if element is not None and not FORMATS[name].takes_element:
        known = ", ".join(other for other, found in FORMATS.items() if found.takes_element)
        raise SettingsError(
            f"the element {element} was asked for (--element), but {FORMATS[name].title} files have no choice"
            f" of elements; expected {known}; leave it out, or choose that format"
        )
    if ascii and FORMATS[name].encoding == "binary":
        known = ", ".join(other for other, found in FORMATS.items() if found.encoding != "binary")
        raise SettingsError(
            f"text was asked for (--ascii), but {FORMATS[name].title} files are binary; expected one of"
            f" {known}; leave --ascii out, or choose another format"
        )


def check_unit(name: str, unit: OutputUnit) -> None:
    """Raise SettingsError if the format has millimetres alone, and another unit is asked for."""
    if unit != "mm" and FORMATS[name].is_ras_mm:
        raise SettingsError(
            f"the unit {unit} was asked for (--unit), but {FORMATS[name].title} files are in millimetres;"
            " leave it out, or choose another format"
        )


def check_space(name: str, space: OutputSpace) -> None:
    """Raise SettingsError if tkrRAS is asked for and the format does not tell the volume that it is of."""
    if space == "tkr" and not FORMATS[name].is_ras_mm:
        known = ", ".join(other for other, found in FORMATS.items() if found.is_ras_mm)
        raise SettingsError(
            f"tkrRAS was asked for (--space tkr), but {FORMATS[name].title} files do not tell the volume that"
            f" it is relative to; expected one of {known}; choose --space ras, or such a format"
        )


def check_values(name: str, values: Sequence[MeshValue]) -> None:
    """Raise SettingsError if values are asked for that the format cannot hold."""
    for value in values:
        kind = "face" if value in FACE_VALUES else "vertex"
        able = [
            other
            for other, found in FORMATS.items()
            if (found.holds_face_values if kind == "face" else found.holds_vertex_values)
        ]
        if name not in able:
            raise SettingsError(
                f"{value} was asked for (--values), a value of each {kind}, but {FORMATS[name].title} files"
                f" hold none; expected one of {', '.join(able)}; leave it out, or choose another format"
            )


def write_mesh(
    path: str,
    mesh: MeshFile,
    *,
    output_format: str | None = None,
    ascii: bool = False,
    element: Element | None = None,
    force: bool = False,
) -> WrittenFile:
    """Write a mesh completely or not at all.

    Args:
        path: The file, or `-` for standard output.
        mesh: What to write.
        output_format: Which format; without it the suffix of `path` tells.
        ascii: Text where the format could be binary too.
        element: What a quad is to a solver, where the format has a choice.
        force: Replace a file that exists.

    Raises:
        SettingsError: The format is not known, or has no text or no choice of elements.
        CallError: It is no `MeshFile`, or has values that the format cannot name.
        WriteError: The file exists, or it cannot be written; an older file is untouched.
    """
    if not isinstance(mesh, MeshFile):
        raise CallError(
            f"a {type(mesh).__name__} was found; expected a MeshFile; make one with file_of_mesh(mesh) first"
        )
    name = choose_format(path, output_format)
    check_encoding(name, ascii=ascii, element=element)
    check_unit(name, mesh.unit)
    choices: dict[str, Any] = {} if element is None else {"element": element}
    told = [*_left_out(mesh, FORMATS[name])]
    encode, beside = function(FORMATS[name].encode), companion_path(path, name)
    more = _companion(mesh, FORMATS[name])
    if not more or beside is None:
        told += [] if not more else [_no_companion(FORMATS[name])]
        size = write_output(path, encode(mesh, ascii=ascii, **choices), force=force)
        return WrittenFile(path, name, size, tuple(told))
    chunks = encode(mesh, ascii=ascii, companion=PurePath(beside).name, **choices)
    size = write_with_companion(path, chunks, beside, more, force=force)
    return WrittenFile(path, name, size, tuple(told), beside)


def companion_path(path: str, name: str) -> str | None:
    """Return where the file stands that belongs beside a mesh of a format; None where there is none.

    Standard output and devices have no place beside them, and a name that is no plain text cannot be told.
    """
    suffix = FORMATS[name].companion_suffix
    if not suffix or path == STREAM or is_device(path) or not PurePath(path).name.isprintable():
        return None
    return str(PurePath(path).with_suffix(suffix))


def _companion(mesh: MeshFile, mesh_format: MeshFormat) -> list[bytes]:
    """Return the bytes of the file that belongs beside a mesh, none where there is nothing to tell."""
    if not mesh_format.encode_companion:
        return []
    return [*function(mesh_format.encode_companion)(mesh)]


def _no_companion(mesh_format: MeshFormat) -> Notice:
    """Return what is told where the file beside the mesh has no place."""
    return Notice(
        "W-MATERIALS-LEFT-OUT",
        f"the materials of {mesh_format.title} are a file beside it ({mesh_format.companion_suffix}), for"
        " which there is no place here: they were left out, colours of vertices are told",
    )


def _left_out(mesh: MeshFile, mesh_format: MeshFormat) -> Iterator[Notice]:
    """Yield a warning of each thing that the format cannot hold."""
    title = mesh_format.title
    if mesh_format.is_ras_mm and mesh.space == "LPS":
        told = f"{title} files are in RAS: the mesh, which is in LPS, was turned to it by half a turn round z"
        yield Notice("W-SPACE-TURNED", told)
    if mesh.quad_count and not mesh_format.holds_quads:
        told = (
            f"{title} files hold no quads: each of {mesh.quad_count} was split into two triangles, along the"
            " diagonal that gives the larger smallest angle"
        )
        yield Notice("W-QUADS-SPLIT", told)
    if mesh.normals is not None and not mesh_format.holds_normals:
        yield Notice("W-NORMALS-LEFT-OUT", f"{title} files hold no normals: they were left out")
    kinds = {"vertices": mesh.vertex_values, "faces": mesh.face_values}
    held = {"vertices": mesh_format.holds_vertex_values, "faces": mesh_format.holds_face_values}
    names = [name for kind, values in kinds.items() if not held[kind] for name in values]
    if names:
        of_what = " and ".join(kind for kind in kinds if not held[kind])
        told = f"{title} files hold no values of {of_what}; left out: {', '.join(names)}"
        yield Notice("W-VALUES-LEFT-OUT", told)
    if (mesh.color is not None or mesh.colors) and not mesh_format.holds_colors:
        yield Notice("W-COLORS-LEFT-OUT", f"{title} files hold no colours: they were left out")
    if mesh.groups and not mesh_format.holds_groups:
        told = f"{title} files hold no groups; left out: {some_of(list(mesh.groups))}"
        yield Notice("W-GROUPS-LEFT-OUT", told)
