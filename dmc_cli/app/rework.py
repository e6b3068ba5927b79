"""Rework the mesh of a file: parts, sides, units, formats; on its volume what `dmc convert` does to one."""

from dataclasses import asdict, dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np

from dmc_cli.app.marked_faces import check_marked, write_marked
from dmc_cli.app.measurement import VolumeReference, measure_mesh
from dmc_cli.app.mesh_stages import size_kernels
from dmc_cli.app.mesh_values import list_values, value_kernels
from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.app.reworked_mesh import Reworked, repairs_faces, surface_of, work_on_mesh, work_on_volume
from dmc_cli.app.unmet_requirements import device_of, refuse_unmet
from dmc_cli.errors import CallError, MeshFileError, RequirementError, SettingsError
from dmc_cli.files import check_output, write_output
from dmc_cli.measures import (
    finding_kernels,
    kernel_modules as report_kernels,
    mask_of_largest,
    plain,
)
from dmc_cli.mesh import connecting_kernels, mesh_of_file
from dmc_cli.mesh_io import (
    MeshFile,
    check_encoding,
    check_values,
    choose_format,
    flip_faces,
    keep_faces,
    read_mesh,
    write_mesh,
)
from dmc_cli.notices import warning_keys
from dmc_cli.processing import kernel_modules as processing_kernels
from dmc_cli.progress import SILENT, Progress, Stopwatch
from dmc_cli.report import SCHEMA, collect_versions, measure_memory, report_text
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import ConvertSettings, OutputSettings, ReworkSettings
from dmc_cli.volume import UNIT_LENGTHS, Space, Volume, intact
from dmc_cli.volume_io import read_volume


@dataclass(frozen=True)
class ReworkResult:
    """What a rework leaves: the mesh as it was written, and the report."""

    mesh: MeshFile
    report: dict[str, Any]


def rework_file(settings: ReworkSettings, progress: Progress = SILENT) -> ReworkResult:
    """Read a mesh, do to it what is asked for, and write it, as `dmc mesh` does.

    Raises:
        SettingsError: An output is an input, or the mesh cannot be what is asked for.
        MeshFileError: The mesh is missing or damaged, or not on the surface of its volume.
        VolumeError: The volume cannot be read.
        RequirementError: A requirement is not met; only a report that was asked for is written then.
        WriteError: An output exists, or cannot be written.
    """
    watch = Stopwatch(progress)
    if settings.volume is not None and settings.isovalue is None:
        raise SettingsError(f"the volume {settings.volume} was given, but no isovalue; give one with -i")
    _check_outputs(settings)
    device = select_device(settings.device, settings.threads)
    with watch.stage("compile", "loading kernels"):
        load_kernels(device, _needed_kernels(settings), progress)
    with watch.stage("read", "reading"):
        mesh = read_mesh(settings.mesh)
        volume = None if settings.volume is None else read_volume(settings.volume, settings.read, progress)
    if volume is not None:
        refuse_overlaps(_as_conversions(settings), [settings.mesh, *volume.files])
    values = np.empty(0) if volume is None else volume.values
    with intact(values, settings.volume or ""):
        work = _reworked(settings, mesh, volume, device, watch)
        report = _make_report(settings, work, volume, device, watch)
    return _finish(settings, work, report, watch)


def _check_outputs(settings: ReworkSettings) -> None:
    """Raise DmcError, before any work, if an output has a name or a place that will not do."""
    refuse_overlaps(_as_conversions(settings), [settings.mesh])
    check_marked(settings.marked, force=settings.force)
    name = choose_format(settings.path, settings.output_format)
    check_encoding(name, ascii=settings.ascii, element=settings.element)
    check_values(name, settings.values)
    for path in (settings.path, settings.report):
        if path is not None:
            check_output(path, force=settings.force)


def _as_conversions(settings: ReworkSettings) -> list[ConvertSettings]:
    """Return conversions that read and write the same files, but for the mesh."""
    outputs = [OutputSettings(path=settings.path, report=settings.report)]
    outputs += [] if settings.marked is None else [OutputSettings(path=settings.marked)]
    return [
        ConvertSettings(
            input=settings.volume or settings.mesh,
            surface=surface_of(settings),
            output=output,
            read=settings.read,
        )
        for output in outputs
    ]


def _needed_kernels(settings: ReworkSettings) -> list[ModuleType]:
    """Return the modules with kernels that a run needs."""
    operations = settings.operations
    modules = [*connecting_kernels(), *value_kernels(settings.values)]
    if settings.is_measured or settings.keep is not None or settings.min_faces or settings.volume is not None:
        modules += report_kernels(intersections=settings.is_measured, thickness=settings.measures_thickness)
    if settings.volume is not None:
        from dmc_cli.contouring import normal_kernels

        modules += normal_kernels()
    if repairs_faces(settings):
        modules += [*processing_kernels(repair=True), *finding_kernels()]
    wanted = operations.simplify != "none"
    modules += processing_kernels(
        simplify=wanted,
        relax=operations.relax > 0,
        remesh=operations.remesh > 0,
        decimate=operations.first_size is not None,
    )
    if operations.first_size is not None:
        modules += size_kernels(operations, is_measured=settings.is_measured)
    return modules


def _reworked(
    settings: ReworkSettings, mesh: MeshFile, volume: Volume | None, device: Device, watch: Stopwatch
) -> Reworked:
    """Return the mesh after everything that is asked for, in the order of the report."""
    read = {"vertices": len(mesh.points), "faces": len(mesh.faces)}
    work = Reworked(mesh, read, None, {}, {}, [*mesh.warnings])
    if settings.keep is not None or settings.min_faces:
        with watch.stage("parts", "choosing components"):
            work.mesh = _kept(settings, mesh, device)
    if settings.flip:
        work.mesh = flip_faces(work.mesh)
    if volume is not None:
        work.warnings += volume.warnings
        work_on_volume(settings, work, volume, device, watch)
    elif settings.operations.first_size is not None or repairs_faces(settings):
        work_on_mesh(settings, work, device, watch)
    placed = _in_output(settings, work.mesh)
    if placed is not work.mesh:  # coordinates are rounded otherwise
        work.mesh, work.intersections = placed, None
    if settings.normals is False:
        work.mesh = replace(work.mesh, normals=None)
    if settings.values:
        listed = list_values(settings.values, mesh_of_file(work.mesh, device), work.placement, volume, watch)
        work.mesh = replace(
            work.mesh,
            vertex_values={**work.mesh.vertex_values, **listed["vertex_values"]},
            face_values={**work.mesh.face_values, **listed["face_values"]},
        )
    return work


def _kept(settings: ReworkSettings, mesh: MeshFile, device: Device) -> MeshFile:
    """Return the components that stay.

    Raises:
        MeshFileError: There is none.
    """
    is_kept = mask_of_largest(mesh_of_file(mesh, device), settings.keep, settings.min_faces)
    if not is_kept.any():
        raise MeshFileError(
            f"{settings.mesh}: no component has {settings.min_faces} faces; expected one at least, which"
            " `dmc measure --json` lists; name fewer faces"
        )
    return mesh if is_kept.all() else keep_faces(mesh, is_kept)


def _in_output(settings: ReworkSettings, mesh: MeshFile) -> MeshFile:
    """Return the mesh in the space and unit of the output.

    Raises:
        SettingsError: RAS or LPS is asked of a mesh without a space, or float32 holds no such coordinates.
    """
    space, unit = _output_space(settings, mesh), settings.unit or mesh.unit
    if settings.space != "native" or unit != mesh.unit:
        mesh = replace(mesh, geometry=None)
    if space == mesh.space and unit == mesh.unit:
        return mesh
    turn = (1.0, 1.0, 1.0) if space == mesh.space else (-1.0, -1.0, 1.0)
    points = mesh.points.astype(np.float64) * turn * (UNIT_LENGTHS[mesh.unit] / UNIT_LENGTHS[unit])
    normals = None if mesh.normals is None else (mesh.normals * turn).astype(np.float32)
    try:
        return replace(mesh, points=points, normals=normals, space=space, unit=unit)
    except CallError as error:
        raise SettingsError(
            f"the unit {unit} was asked for, but coordinates would be as large as {np.abs(points).max():.2g};"
            " expected some that float32 holds; choose a larger unit"
        ) from error


def _output_space(settings: ReworkSettings, mesh: MeshFile) -> Space:
    """Return the space of the output."""
    if settings.space == "native":
        return mesh.space
    if mesh.space == "none":
        raise SettingsError(
            f"--space {settings.space} was asked for, but {settings.mesh} does not say how its axes lie in"
            " the patient; use --space native"
        )
    return "RAS" if settings.space == "ras" else "LPS"


def _make_report(
    settings: ReworkSettings, work: Reworked, volume: Volume | None, device: Device, watch: Stopwatch
) -> dict[str, Any]:
    """Return the report, with the mesh's measures if they are needed."""
    mesh = work.mesh
    measured: dict[str, Any] = {
        "mesh": {
            "path": settings.path,
            "space": mesh.space,
            "unit": mesh.unit,
            "vertices": len(mesh.points),
            "faces": len(mesh.faces),
            "quads": mesh.quad_count,
            "triangles": mesh.triangle_count,
        }
    }
    if settings.is_measured:
        reference = None
        if volume is not None and settings.isovalue is not None:
            reference = VolumeReference(volume=volume, isovalue=settings.isovalue, inside=settings.inside)
        with watch.stage("report", "measuring"):
            measured = measure_mesh(
                device,
                replace(mesh, warnings=()),
                settings.path,
                reference,
                thickness=settings.measures_thickness,
                wall=settings.wall,
                known_intersections=work.intersections,
            )
    told = {key: measured.pop(key, []) for key in ("warnings", "warning_codes")}
    own = warning_keys(work.warnings)
    return {
        "schema": SCHEMA,
        **{key: list(dict.fromkeys([*own[key], *told[key]])) for key in told},
        "input": {"path": settings.mesh, **work.read},
        "settings": plain(_settings_section(settings, device)),
        "mesh": measured["mesh"],
        **{key: measured.get(key) for key in ("topology", "quality", "deviation")},
        "requirements": [],
        **{key: measured.get(key) for key in ("thickness", "components")},
        "simplification": plain(work.simplification) or None,
        "repair": work.repair or None,
        "size": work.size,
        "timings_ms": {},
        "memory": {},
        "versions": collect_versions(device.name),
    }


def _settings_section(settings: ReworkSettings, device: Device) -> dict[str, Any]:
    """Return every setting under the name of its option, in one level."""
    section: dict[str, Any] = asdict(settings)
    operations, read = section.pop("operations"), section.pop("read")
    found = {"input": section.pop("mesh"), "output": section.pop("path"), **operations, **read, **section}
    return found | {"device": device.name, "threads": device.threads}


def _finish(
    settings: ReworkSettings, work: Reworked, report: dict[str, Any], watch: Stopwatch
) -> ReworkResult:
    """Check what is required, then write the mesh and the report, which names what is not met."""
    device, force = device_of(report), settings.force
    if not settings.dry_run:
        write_marked(settings.marked, settings.require, report, work.mesh, device, force=force)
    try:
        refuse_unmet(report, settings.require, work.mesh, device)
    except RequirementError:
        _write_report(settings, report, watch)
        raise
    if not settings.dry_run:
        with watch.stage("write", "writing"):
            written = write_mesh(
                settings.path,
                work.mesh,
                output_format=settings.output_format,
                ascii=settings.ascii,
                element=settings.element,
                force=settings.force,
            )
        for key, told in warning_keys(written.warnings).items():
            report[key] += told
    _write_report(settings, report, watch)
    return ReworkResult(work.mesh, report)


def _write_report(settings: ReworkSettings, report: dict[str, Any], watch: Stopwatch) -> None:
    """Complete the report, and write it where it was asked for."""
    watch.total()
    report["timings_ms"] = {stage: round(ms, 3) for stage, ms in watch.milliseconds.items()}
    report["memory"] = measure_memory(report["settings"]["device"])
    if settings.report is not None:
        write_output(settings.report, [report_text(report).encode()], force=settings.force)
