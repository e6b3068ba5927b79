"""Write a mesh with what each of its faces is to blame for, so that it can be looked at.

What `--require` refuses is not written where it was to go; this file is written whatever comes of it.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from dmc_cli.errors import SettingsError
from dmc_cli.files import check_output
from dmc_cli.measures import kernel_modules, list_kernels
from dmc_cli.mesh import connect, mesh_of_file
from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io import MeshFile, choose_format, write_mesh
from dmc_cli.notices import warning_keys
from dmc_cli.report import count_blame
from dmc_cli.runtime import Device, load_kernels

UNMET = "unmet"
"""The value of a face: how many requirements it is to blame for, parts of sets each."""


def check_marked(path: str | None, *, force: bool) -> None:
    """Raise DmcError, before any work, if a marked mesh has a name, a format or a place that will not do."""
    if path is None:
        return
    able = [name for name, known in FORMATS.items() if known.holds_face_values]
    name = choose_format(path)
    if name not in able:
        raise SettingsError(
            f"{path} is to have a value of each face, but {FORMATS[name].title} files hold none; expected one"
            f" of {', '.join(able)}; change its name"
        )
    check_output(path, force=force)


def write_marked(
    path: str | None,
    required: Iterable[str],
    report: dict[str, Any],
    mesh: MeshFile,
    device: Device,
    *,
    force: bool,
) -> None:
    """Write a mesh with the value `UNMET` of its faces, 0 where all is as required.

    Args:
        path: The file; None writes nothing.
        required: Words, sets and comparisons.
        report: The report on the mesh, which is told what is lost in the file's format.
        mesh: The mesh.
        device: Where to look at the faces.
        force: Whether the file may exist.

    Raises:
        WriteError: The file cannot be written.
    """
    if path is None:
        return
    load_kernels(device, [*kernel_modules(intersections=True), *list_kernels()])
    counts = count_blame(report, required, connect(mesh_of_file(mesh, device)))
    marked = replace(mesh, face_values={**mesh.face_values, UNMET: counts}, warnings=())
    written = write_mesh(path, marked, force=force)
    for key, told in warning_keys(written.warnings).items():
        report[key] += told
