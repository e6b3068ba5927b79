"""Do to the mesh of a file what is asked for: on its volume's isosurface, or without one on its own."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.app.mesh_stages import (
    Stages,
    decimate_stages,
    measure_size,
    relax_stages,
    repair_stages,
    simplify_stages,
)
from dmc_cli.array_types import Float64Array
from dmc_cli.errors import CallError, MeshFileError
from dmc_cli.field import upload_volume
from dmc_cli.measures import locate_mesh
from dmc_cli.mesh import (
    OWN_PREFIX,
    Mesh,
    Placement,
    connect,
    file_of_mesh,
    mesh_of_file,
    vertex_normals,
)
from dmc_cli.mesh_io import MeshFile
from dmc_cli.notices import Notice
from dmc_cli.progress import Stopwatch
from dmc_cli.runtime import Device
from dmc_cli.settings import ReworkSettings, SurfaceSettings, repairs
from dmc_cli.volume import RAS_LPS, UNIT_LENGTHS, Volume, is_turned

GROUP = OWN_PREFIX + "group"
"""The value of faces that tells which of the file's groups each is in, int32."""


@dataclass
class Reworked:
    """A mesh at work, and what is told of it."""

    mesh: MeshFile
    read: dict[str, int]
    placement: Placement | None
    simplification: dict[str, Any]
    repair: dict[str, int]
    warnings: list[Notice]
    size: dict[str, Any] | None = None
    intersections: int | None = None


def surface_of(settings: ReworkSettings) -> SurfaceSettings:
    """Return the surface that the mesh lies on; vertices of an open border never touch the virtual layer."""
    return SurfaceSettings(isovalue=settings.isovalue or 0.0, inside=settings.inside, border="closed")


def repairs_faces(settings: ReworkSettings) -> bool:
    """Return whether faces that intersect are pulled apart; where nothing else is done, only if one asks."""
    if settings.volume is None and settings.operations.first_size is None:
        return settings.operations.repair_intersections is True
    return repairs(settings.operations, settings.require)


def work_on_mesh(settings: ReworkSettings, work: Reworked, device: Device, watch: Stopwatch) -> None:
    """Take quads away from a mesh, and pull faces apart that intersect, without a volume."""
    file, operations = work.mesh, settings.operations
    stages = Stages(connect(_grouped(file, device)), None)
    if operations.first_size is not None:
        to_mm = np.eye(3) * UNIT_LENGTHS[file.unit]
        decimate_stages(stages, operations, to_mm, watch, is_measured=settings.is_measured)
    _finish_stages(settings, work, stages, watch)
    points, faces = stages.mesh.positions.numpy(), stages.mesh.faces.numpy()
    normals = vertex_normals(points, faces).astype(np.float32) if settings.has_normals else None
    work.mesh = _file_of(stages.mesh, normals, file)


def _finish_stages(settings: ReworkSettings, work: Reworked, stages: Stages, watch: Stopwatch) -> None:
    """Repair the mesh if that is wanted, measure its size, and note what the stages tell."""
    if repairs_faces(settings):
        repair_stages(stages, watch)
        work.repair, work.intersections = stages.repair, stages.repair["pairs_after"]
    measure_size(stages, watch)
    work.size = stages.size or None
    work.warnings += stages.warnings


def _grouped(file: MeshFile, device: Device) -> Mesh:
    """Return the mesh of a file on a device, with the numbers of its faces' groups if it has any."""
    mesh = mesh_of_file(file, device)
    if not file.groups:
        return mesh
    numbers = np.repeat(np.arange(len(file.groups), dtype=np.int32), list(file.groups.values()))
    return mesh.with_face_values({GROUP: wp.array(numbers, dtype=wp.int32, device=device.name)})


def _file_of(mesh: Mesh, normals: Any, file: MeshFile) -> MeshFile:
    """Return a mesh that was a file's as one again, faces of a group one after the other as they were."""
    found = replace(
        file_of_mesh(mesh, normals, file.space, file.unit), color=file.color, geometry=file.geometry
    )
    if not file.groups:
        return found
    number = mesh.face_values[GROUP].numpy()
    order = np.argsort(number, kind="stable")
    counts = np.bincount(number, minlength=len(file.groups)).tolist()
    groups = {name: count for name, count in zip(file.groups, counts, strict=True) if count}
    return replace(
        found,
        faces=found.faces[order],
        face_values={name: values[order] for name, values in found.face_values.items()},
        groups=groups,
        colors={name: color for name, color in file.colors.items() if name in groups},
    )


def work_on_volume(
    settings: ReworkSettings, work: Reworked, volume: Volume, device: Device, watch: Stopwatch
) -> None:
    """Simplify, remesh and relax the mesh on its isosurface, and take normals from there."""
    surface, file = surface_of(settings), work.mesh
    on_device, mesh = upload_volume(volume, device), connect(_grouped(file, device))
    with watch.stage("locate", "locating the vertices"):
        try:
            placement = locate_mesh(mesh, on_device, surface, _to_mesh_space(volume, file))
        except CallError as error:
            raise MeshFileError(f"{settings.mesh} is not on the isosurface: {error}") from error
    stages = Stages(mesh, placement)
    del mesh, placement
    operations = settings.operations
    if operations.simplify != "none":
        simplify_stages(stages, operations, watch)
        work.simplification = stages.simplification
    if operations.first_size is not None:
        to_mm = stages.to_millimetres(volume)
        decimate_stages(stages, operations, to_mm, watch, is_measured=settings.is_measured)
    if operations.relax:
        relax_stages(stages, operations.relax, watch)
    _finish_stages(settings, work, stages, watch)
    normals = None
    if settings.has_normals:
        from dmc_cli.contouring import compute_normals

        with watch.stage("normals", "computing normals"):
            places = stages.require_placement()
            sides = places.frame.sense * (1.0 if settings.inside == "below" else -1.0)
            normals = compute_normals(places, surface).numpy() * np.float32(sides)  # as faces look
    work.placement = stages.placement
    work.mesh = _file_of(stages.mesh, normals, file)


def _to_mesh_space(volume: Volume, mesh: MeshFile) -> Float64Array:
    """Return the map from the volume's node indices to the space and unit of a mesh, shape (4, 4)."""
    turned = is_turned(mesh.space, volume.space)
    affine = RAS_LPS @ volume.affine if turned else volume.affine.copy()
    affine[:3] *= 1.0 / UNIT_LENGTHS[mesh.unit]
    return affine
