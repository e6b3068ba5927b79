"""Write a mesh that was measured with what each of its faces is to blame for, so that it can be looked at."""

from dataclasses import replace
from typing import Any

from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.errors import SettingsError
from dmc_cli.files import check_output
from dmc_cli.measures import kernel_modules, list_kernels
from dmc_cli.mesh import connect, mesh_of_file
from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io import MeshFile, choose_format, write_mesh
from dmc_cli.notices import warning_keys
from dmc_cli.report import count_blame
from dmc_cli.runtime import Device, load_kernels
from dmc_cli.settings import ConvertSettings, MeasureSettings, OutputSettings, SurfaceSettings

UNMET = "unmet"
"""The value of a face: how many requirements it is to blame for, parts of sets each."""


def check_marked(settings: MeasureSettings) -> None:
    """Raise DmcError, before any work, if the marked mesh has a name or a format that will not do."""
    path = settings.marked
    if path is None:
        return
    able = [name for name, known in FORMATS.items() if known.holds_face_values]
    name = choose_format(path)
    if name not in able:
        raise SettingsError(
            f"{path} is to have a value of each face, but {FORMATS[name].title} files hold none; expected one"
            f" of {', '.join(able)}; change its name"
        )
    as_conversion = ConvertSettings(
        input=settings.volume or settings.mesh,
        surface=SurfaceSettings(isovalue=0.0),
        output=OutputSettings(path=path),
        read=settings.read,
    )
    refuse_overlaps([as_conversion], [one for one in (settings.mesh, settings.against) if one is not None])
    check_output(path, force=settings.force)


def write_marked(settings: MeasureSettings, report: dict[str, Any], mesh: MeshFile, device: Device) -> None:
    """Write the mesh with the value `UNMET` of its faces, where that is asked for; 0 is as required."""
    if settings.marked is None:
        return
    load_kernels(device, [*kernel_modules(intersections=True), *list_kernels()])
    counts = count_blame(report, settings.require, connect(mesh_of_file(mesh, device)))
    marked = replace(mesh, face_values={**mesh.face_values, UNMET: counts}, warnings=())
    written = write_mesh(settings.marked, marked, force=settings.force)
    for key, told in warning_keys(written.warnings).items():
        report[key] += told
