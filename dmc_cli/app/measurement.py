"""Measure a mesh file: topology and quality, and with its volume the deviation.

A file has no twins and no cells. Twins are paired by vertices (`twins.py`); a vertex's cell follows from its
coordinates, so its deviation contains the rounding of the file's coordinates.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from dmc_cli.app.marked_faces import check_marked, write_marked
from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.app.unmet_requirements import refuse_unmet
from dmc_cli.errors import MeshFileError
from dmc_cli.field import upload_volume
from dmc_cli.measures import (
    Deviation,
    count_intersections,
    file_rounding,
    frame_of_volume,
    kernel_modules,
    list_components,
    locate_points,
    measure_curvature,
    measure_deviation,
    measure_distance,
    measure_elements,
    measure_quality,
    measure_thickness,
    measure_topology,
    plain,
    rounding_warning,
)
from dmc_cli.mesh import Mesh, connect, mesh_of_file
from dmc_cli.mesh_io import MeshFile, read_mesh
from dmc_cli.notices import Notice, warning_keys
from dmc_cli.progress import SILENT, Progress
from dmc_cli.report import (
    SCHEMA,
    collect_versions,
    components_section,
    extent_section,
    quality_section,
    topology_section,
)
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import ConvertSettings, Inside, MeasureSettings, OutputSettings, SurfaceSettings
from dmc_cli.volume import UNIT_LENGTHS, Volume, intact, is_turned
from dmc_cli.volume_io import read_volume


@dataclass(frozen=True, kw_only=True)
class VolumeReference:
    """The volume and level that a mesh is held against; `isovalue` is in physical values.

    `inside` says which side is the object, outside which virtual nodes and nodes without data lie.
    """

    volume: Volume
    isovalue: float
    inside: Inside = "above"


@dataclass(frozen=True, kw_only=True)
class OtherMesh:
    """The mesh of a file that a distance is measured to, by `density` samples on a unit of area."""

    mesh: MeshFile
    path: str = ""
    density: float | None = None


def measure_file(settings: MeasureSettings, progress: Progress = SILENT) -> dict[str, Any]:
    """Return the report on a mesh file, as `dmc measure` does.

    Raises:
        RequirementError: The mesh is not what is required of it; the error has the report.
        MeshFileError: The mesh is missing or damaged.
        VolumeError: The volume cannot be read.
        DeviceError: There is no such device.
        WriteError: The marked mesh exists, or cannot be written.
    """
    _check_marked(settings)
    device = select_device(settings.device, settings.threads)
    modules = kernel_modules(
        intersections=True,
        curvature=settings.finds_curvature,
        distance=settings.against is not None,
        thickness=settings.measures_thickness,
    )
    load_kernels(device, modules, progress)
    with progress.stage("reading"):
        mesh = read_mesh(settings.mesh)
        other, reference = None, None
        if settings.against is not None:
            found = read_mesh(settings.against)
            other = OtherMesh(mesh=found, path=settings.against, density=settings.density)
        if settings.volume is not None and settings.isovalue is not None:
            volume = read_volume(settings.volume, settings.read, progress)
            reference = VolumeReference(volume=volume, isovalue=settings.isovalue, inside=settings.inside)
    values = reference.volume.values if reference is not None else np.empty(0)
    with progress.stage("measuring"), intact(values, settings.volume or ""):
        report = measure_mesh(
            device,
            mesh,
            settings.mesh,
            reference,
            other,
            curvature=settings.finds_curvature,
            thickness=settings.measures_thickness,
            wall=settings.wall,
        )
    write_marked(settings.marked, settings.require, report, mesh, device, force=settings.force)
    refuse_unmet(report, settings.require, mesh, device)
    return report


def _check_marked(settings: MeasureSettings) -> None:
    """Raise DmcError, before any work, if the marked mesh has a name that will not do or is an input."""
    if settings.marked is None:
        return
    check_marked(settings.marked, force=settings.force)
    as_conversion = ConvertSettings(
        input=settings.volume or settings.mesh,
        surface=SurfaceSettings(isovalue=0.0),
        output=OutputSettings(path=settings.marked),
        read=settings.read,
    )
    refuse_overlaps([as_conversion], [one for one in (settings.mesh, settings.against) if one is not None])


def measure_mesh(
    device: Device,
    mesh: MeshFile,
    path: str = "",
    reference: VolumeReference | None = None,
    other: OtherMesh | None = None,
    *,
    curvature: bool = False,
    thickness: bool = False,
    wall: float | None = None,
    known_intersections: int | None = None,
) -> dict[str, Any]:
    """Return the report on a mesh file.

    Its sections: schema, warnings, mesh, topology, quality, deviation, requirements (none yet), curvature,
    thickness, components, distance, versions.

    Args:
        device: Where to work.
        mesh: The mesh.
        path: Its file, for the report.
        reference: What the mesh is an isosurface of, or None.
        other: What its distance is measured to, or None.
        curvature: Whether it is measured.
        thickness: Whether that of walls is measured.
        wall: A thickness, in the mesh's unit, below which it is told how much lies.
        known_intersections: How many pairs of faces intersect, where that is known.
    """
    found = connect(mesh_of_file(mesh, device))
    topology, quality = measure_topology(found), measure_quality(found)
    crossings = count_intersections(found) if known_intersections is None else known_intersections
    warnings: list[Notice] = [*mesh.warnings]
    deviation = None
    if reference is not None:
        warnings += reference.volume.warnings
        deviation, told = _compared(device, mesh, reference)
        warnings += told
    distance = None
    if other is not None:
        warnings += other.mesh.warnings
        distance, told = _distance(found, mesh, other)
        warnings += told
    triangles = mesh.triangle_count
    return {
        "schema": SCHEMA,
        **warning_keys(warnings),
        "mesh": plain(
            {
                "path": path,
                "space": mesh.space,
                "unit": mesh.unit,
                "vertices": len(mesh.points),
                "faces": len(mesh.faces),
                "quads": len(mesh.faces) - triangles,
                "triangles": triangles,
                **extent_section(quality, topology),
            }
        ),
        "topology": plain(topology_section(topology)),
        "quality": plain(quality_section(quality, measure_elements(found), crossings)),
        "deviation": plain(asdict(deviation)) if deviation else None,
        "requirements": [],
        "curvature": plain(asdict(measure_curvature(found))) if curvature else None,
        "thickness": plain(asdict(measure_thickness(found, wall))) if thickness else None,
        "components": plain(components_section(list_components(found))),
        "distance": distance,
        "versions": collect_versions(device.name),
    }


def _distance(found: Mesh, mesh: MeshFile, other: OtherMesh) -> tuple[dict[str, Any], list[Notice]]:
    """Return the section `distance`, in the unit and axes of the measured mesh, and what is to be told."""
    told, spaces = [], {mesh.space, other.mesh.space}
    if len(spaces) == 2 and "none" in spaces:
        sentence = f"the spaces of the meshes are {mesh.space} and {other.mesh.space}; taken for the same"
        told.append(Notice("W-SPACE-UNKNOWN", sentence))
    factor = UNIT_LENGTHS[other.mesh.unit] / UNIT_LENGTHS[mesh.unit]
    sign = -1.0 if is_turned(mesh.space, other.mesh.space) else 1.0
    turn = (sign * factor, sign * factor, factor)
    points = other.mesh.points.astype(np.float64) * turn
    farthest = float(np.abs(points).max(initial=0.0))
    if farthest > float(np.finfo(np.float32).max):
        raise MeshFileError(
            f"{other.path}: coordinates up to {farthest:.3g} {mesh.unit}, the unit of the measured mesh, were"
            " found; expected some that float32 holds; write both meshes in the same unit"
        )
    moved = MeshFile(points=points, faces=other.mesh.faces)
    distance = measure_distance(found, mesh_of_file(moved, found.device), other.density)
    return plain({"path": other.path, "unit": mesh.unit, **asdict(distance)}), told


def _compared(device: Device, mesh: MeshFile, reference: VolumeReference) -> tuple[Deviation, list[Notice]]:
    """Return the deviation of the mesh with the rounding of its coordinates, and what is to be told.

    It is held against the grid with a closed border: vertices of an open one never touch the virtual layer,
    nor nodes without data, which lie outside the object under a closed border.
    """
    told = []
    volume = reference.volume
    settings = SurfaceSettings(isovalue=reference.isovalue, inside=reference.inside, border="closed")
    frame = frame_of_volume(upload_volume(volume, device), settings)
    turned = is_turned(mesh.space, volume.space)
    points = mesh.points * UNIT_LENGTHS[mesh.unit] if mesh.unit != "mm" else mesh.points
    placement, beyond = locate_points(points * (-1.0, -1.0, 1.0) if turned else points, frame)
    if outside := int(np.count_nonzero(beyond)):
        sentence = f"{outside} vertices lie outside the volume; they are measured at its border"
        told.append(Notice("W-OUTSIDE-VOLUME", sentence))
    rounding = file_rounding(mesh.points, volume, UNIT_LENGTHS[mesh.unit])
    if warning := rounding_warning(rounding):
        told.append(warning)
    deviation = measure_deviation(placement, volume, volume.value_range())
    return replace(deviation, rounding_mm=rounding.mm, rounding_relative=rounding.relative), told
