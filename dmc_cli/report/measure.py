"""Measure a mesh file: topology and quality, and with its volume the deviation.

A file has no twins and no cells. Twins are paired by vertices (`twins.py`); a vertex's cell follows from its
coordinates, so its deviation contains the rounding of the file's coordinates.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.device import Device, load_kernels, select_device
from dmc_cli.progress import SILENT, Progress
from dmc_cli.report import kernel_modules
from dmc_cli.report.deviation import Deviation, measure_deviation
from dmc_cli.report.mesh_files.mesh_input import MeshInput
from dmc_cli.report.mesh_files.read import read_mesh
from dmc_cli.report.plain_values import plain
from dmc_cli.report.quality import measure_quality
from dmc_cli.report.report import SCHEMA, extent_section, quality_section, topology_section
from dmc_cli.report.topology import measure_topology
from dmc_cli.report.twins import find_twins
from dmc_cli.report.versions import collect_versions
from dmc_cli.settings import MeasureSettings, SurfaceSettings
from dmc_cli.surface.field import absent_value, make_field, upload_volume
from dmc_cli.surface.grid import grid_of
from dmc_cli.surface.slices import slice_depths
from dmc_cli.volume.read import read_volume
from dmc_cli.volume.volume import Volume

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, kw_only=True)
class VolumeReference:
    """The volume and level that a mesh is held against; `isovalue` is in physical values."""

    volume: Volume
    isovalue: float


def measure_file(settings: MeasureSettings, progress: Progress = SILENT) -> dict[str, Any]:
    """Return the report on a mesh file, as `dmc measure` does.

    Raises:
        MeshFileError: The mesh is missing or damaged.
        VolumeError: The volume cannot be read.
        DeviceError: There is no such device.
    """
    device = select_device(settings.device, settings.threads)
    load_kernels(device, kernel_modules(), progress)
    with progress.stage("reading"):
        mesh = read_mesh(settings.mesh)
        reference = None
        if settings.volume is not None and settings.isovalue is not None:
            volume = read_volume(settings.volume, settings.read, progress)
            reference = VolumeReference(volume=volume, isovalue=settings.isovalue)
    with progress.stage("measuring"):
        return measure_mesh(device, mesh, settings.mesh, reference)


def measure_mesh(
    device: Device, mesh: MeshInput, path: str = "", reference: VolumeReference | None = None
) -> dict[str, Any]:
    """Return the report on a mesh file: schema, warnings, mesh, topology, quality, deviation, versions.

    Args:
        device: Where to work.
        mesh: The mesh.
        path: Its file, for the report.
        reference: What the mesh is an isosurface of, or None.
    """
    points = wp.array(mesh.points.astype(np.float32), dtype=wp.vec3f, device=device.name)
    faces = wp.array(mesh.faces, dtype=wp.int32, device=device.name)
    twins = find_twins(device, faces, len(mesh.points))
    topology = measure_topology(device, faces, twins, len(mesh.points))
    quality = measure_quality(device, points, faces)
    warnings: list[str] = []
    deviation = None
    if reference is not None:
        warnings += reference.volume.warnings
        cells, locals, outside = locate_points(mesh, reference.volume)
        if outside:
            warnings.append(f"{outside} vertices lie outside the volume; they are measured at its border")
        deviation = _deviation(device, reference, cells, locals)
    triangles = mesh.triangle_count
    return {
        "schema": SCHEMA,
        "warnings": warnings,
        "mesh": plain(
            {
                "path": path,
                "space": mesh.space,
                "vertices": len(mesh.points),
                "faces": len(mesh.faces),
                "quads": len(mesh.faces) - triangles,
                "triangles": triangles,
                **extent_section(quality, topology),
            }
        ),
        "topology": plain(topology_section(topology)),
        "quality": plain(quality_section(quality)),
        "deviation": plain(asdict(deviation)) if deviation else None,
        "versions": collect_versions(device.name),
    }


def locate_points(mesh: MeshInput, volume: Volume) -> tuple[Array, Array, int]:
    """Return each point's cell in the grid with a closed border, its place there, and how many are outside.

    Returns:
        Linear numbers of the cells' lowest nodes, (V,) int64; coordinates in the cells, (V, 3) float32,
        clamped to [0, 1]; the number of points outside the grid, over a spacing outside the volume.
    """
    points = mesh.points
    if "none" not in (mesh.space, volume.space) and mesh.space != volume.space:
        points = points * (-1.0, -1.0, 1.0)
    to_grid = np.linalg.inv(volume.affine)
    at = points @ to_grid[:3, :3].T + to_grid[:3, 3] + 1.0
    at[:, 2] = _slice_places(at[:, 2], volume)
    nodes = np.array(volume.shape) + 2
    lowest = np.clip(np.floor(at), 0, nodes - 2)
    local = at - lowest
    is_outside = ((local < 0) | (local > 1)).any(axis=1)
    i, j, k = lowest.astype(np.int64).T
    cells = i + nodes[0] * (j + nodes[1] * k)
    return cells, np.clip(local, 0, 1).astype(np.float32), int(np.count_nonzero(is_outside))


def _slice_places(depths: Array, volume: Volume) -> Array:
    """Return coordinates along the slices of the grid with a closed border, from depths of even slices."""
    known = slice_depths(volume, grid_of(volume.shape, border=1), Device("cpu")).numpy()
    if not known.size:
        return depths
    beyond = depths - np.clip(depths, known[0], known[-1])
    return np.asarray(np.interp(depths, known, np.arange(len(known))) + beyond)


def _deviation(device: Device, reference: VolumeReference, cells: Array, locals: Array) -> Deviation:
    """Measure against the grid with a closed border: an open one's vertices never touch its virtual layer."""
    volume = reference.volume
    uploaded = upload_volume(volume, device)
    field = make_field(uploaded, SurfaceSettings(isovalue=reference.isovalue, border="closed"))
    field.absent = absent_value(volume, field)
    return measure_deviation(
        device,
        volume,
        volume.value_range(),
        field,
        grid_of(volume.shape, border=1),
        wp.array(cells, dtype=wp.int64, device=device.name),
        wp.array(locals, dtype=wp.vec3f, device=device.name),
    )
