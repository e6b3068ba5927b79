"""Measure a mesh file: topology and quality, and with its volume the deviation.

A file has no twins and no cells. Twins are paired by vertices (`twins.py`); a vertex's cell follows from its
coordinates, so its deviation contains the rounding of the file's coordinates.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from dmc_cli.field import upload_volume
from dmc_cli.measures import (
    Deviation,
    count_intersections,
    file_rounding,
    frame_of_volume,
    kernel_modules,
    locate_points,
    measure_deviation,
    measure_elements,
    measure_quality,
    measure_topology,
    plain,
    rounding_warning,
)
from dmc_cli.mesh import connect, mesh_of_file
from dmc_cli.mesh_io import MeshFile, read_mesh
from dmc_cli.notices import Notice, warning_keys
from dmc_cli.progress import SILENT, Progress
from dmc_cli.report import SCHEMA, collect_versions, extent_section, quality_section, topology_section
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import Inside, MeasureSettings, SurfaceSettings
from dmc_cli.volume import UNIT_LENGTHS, Volume, intact
from dmc_cli.volume_io import read_volume


@dataclass(frozen=True, kw_only=True)
class VolumeReference:
    """The volume and level that a mesh is held against; `isovalue` is in physical values.

    `inside` says which side is the object, outside which virtual nodes and nodes without data lie.
    """

    volume: Volume
    isovalue: float
    inside: Inside = "above"


def measure_file(settings: MeasureSettings, progress: Progress = SILENT) -> dict[str, Any]:
    """Return the report on a mesh file, as `dmc measure` does.

    Raises:
        MeshFileError: The mesh is missing or damaged.
        VolumeError: The volume cannot be read.
        DeviceError: There is no such device.
    """
    device = select_device(settings.device, settings.threads)
    load_kernels(device, kernel_modules(intersections=True), progress)
    with progress.stage("reading"):
        mesh = read_mesh(settings.mesh)
        reference = None
        if settings.volume is not None and settings.isovalue is not None:
            volume = read_volume(settings.volume, settings.read, progress)
            reference = VolumeReference(volume=volume, isovalue=settings.isovalue, inside=settings.inside)
    values = reference.volume.values if reference is not None else np.empty(0)
    with progress.stage("measuring"), intact(values, settings.volume or ""):
        return measure_mesh(device, mesh, settings.mesh, reference)


def measure_mesh(
    device: Device, mesh: MeshFile, path: str = "", reference: VolumeReference | None = None
) -> dict[str, Any]:
    """Return the report on a mesh file: schema, warnings, mesh, topology, quality, deviation, versions.

    Args:
        device: Where to work.
        mesh: The mesh.
        path: Its file, for the report.
        reference: What the mesh is an isosurface of, or None.
    """
    found = connect(mesh_of_file(mesh, device))
    topology, quality = measure_topology(found), measure_quality(found)
    warnings: list[Notice] = [*mesh.warnings]
    deviation = None
    if reference is not None:
        warnings += reference.volume.warnings
        deviation, told = _compared(device, mesh, reference)
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
        "quality": plain(quality_section(quality, measure_elements(found), count_intersections(found))),
        "deviation": plain(asdict(deviation)) if deviation else None,
        "versions": collect_versions(device.name),
    }


def _compared(device: Device, mesh: MeshFile, reference: VolumeReference) -> tuple[Deviation, list[Notice]]:
    """Return the deviation of the mesh with the rounding of its coordinates, and what is to be told.

    It is held against the grid with a closed border: vertices of an open one never touch the virtual layer,
    nor nodes without data, which lie outside the object under a closed border.
    """
    told = []
    volume = reference.volume
    settings = SurfaceSettings(isovalue=reference.isovalue, inside=reference.inside, border="closed")
    frame = frame_of_volume(upload_volume(volume, device), settings)
    turned = "none" not in (mesh.space, volume.space) and mesh.space != volume.space
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
