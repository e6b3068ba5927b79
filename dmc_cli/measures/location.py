"""Locate a mesh in the grid of its volume: each vertex's cell, and its coordinates there.

A file holds positions only. Stages that keep a mesh on its surface, and the deviation, need a `Placement`.
"""

from dataclasses import replace

import numpy as np
import warp as wp

from dmc_cli.array_types import Float32Array, Float64Array, FloatArray
from dmc_cli.errors import CallError
from dmc_cli.field import DeviceVolume, grid_affine, grid_of, make_field, nodata_value, slice_depths
from dmc_cli.measures.deviation import measure_deviation
from dmc_cli.mesh import COARSE, Mesh, Placement, SurfaceFrame, require_mesh
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume

FARTHEST = 1.0
"""Spacings from the surface at which a vertex is not of it: the papers' placements leave some within one."""


def locate_mesh(
    mesh: Mesh, volume: DeviceVolume, settings: SurfaceSettings, affine: Float64Array | None = None
) -> Placement:
    """Return where the vertices of an isosurface lie in its volume, as stages and normals need it.

    Args:
        mesh: The mesh, whoever made it, such as `mesh_of_file` returns it.
        volume: The volume whose isosurface it is, on the mesh's device.
        settings: Isovalue, side, border and orientation of the isosurface.
        affine: Shape (4, 4): node index to the space that the mesh is in; the volume's own if None.

    Raises:
        CallError: A vertex lies outside the grid or farther than `FARTHEST` from the surface, or mesh and
            volume are not on one device.
    """
    from dmc_cli.contouring import compute_normals  # only here: kernels that other measures need not read

    _require_one_device(mesh, volume)
    frame = frame_of_volume(volume, settings, affine)
    placement, beyond = locate_points(mesh.positions.numpy().astype(np.float64), frame)
    if outside := int(np.count_nonzero(~(beyond <= COARSE))):
        raise CallError(
            f"{outside} of {mesh.vertex_count} vertices lie outside the volume's grid, by up to"
            f" {beyond.max():.3g} cells; expected all of them inside; pass the volume that the mesh"
            " was made of, the border it was made with, and the affine of the space that it is in"
        )
    _refuse_far(placement, volume.volume)
    sense = frame.sense * _orientation(mesh, compute_normals(placement, settings).numpy())
    return Placement(placement.cell, placement.local, replace(frame, sense=sense))


def frame_of_volume(
    volume: DeviceVolume, settings: SurfaceSettings, affine: Float64Array | None = None
) -> SurfaceFrame:
    """Return the surface that `extract_surface` would find vertices on; the arguments are those."""
    device, source = volume.device, volume.volume
    field = make_field(volume, settings)
    field.has_nodata = int(_lacks_data(source))
    field.nodata = nodata_value(source, field)
    grid = grid_of(source.shape, border=int(settings.border == "closed"))
    depths = slice_depths(source, grid, device)
    to_output = grid_affine(source.affine if affine is None else affine, grid)
    towards_higher = settings.orientation == "gradient" or settings.inside == "below"
    return SurfaceFrame(field, grid, to_output, depths, 1.0 if towards_higher else -1.0, device)


def locate_points(points: FloatArray, frame: SurfaceFrame) -> tuple[Placement, Float64Array]:
    """Return where points lie, and how far each is outside the grid.

    Args:
        points: Positions in the output space, (V, 3) float64.
        frame: Whose grid they are located in.

    Returns:
        Their places, local coordinates clamped to [0, 1]; cells along an axis that each is outside, (V,).
    """
    affine, grid, depths, device = frame.affine, frame.grid, frame.depths.numpy(), frame.device
    at = (points - affine[:3, 3]) @ np.linalg.inv(affine[:3, :3]).T
    if depths.size:
        past = at[:, 2] - np.clip(at[:, 2], depths[0], depths[-1])
        at[:, 2] = np.interp(at[:, 2], depths, np.arange(len(depths))) + past
    lowest = np.nan_to_num(np.clip(np.floor(at), 0, np.array((grid.nx, grid.ny, grid.nz)) - 2))
    local = at - lowest
    inside = np.clip(local, 0, 1)
    i, j, k = lowest.astype(np.int64).T
    placement = Placement(
        wp.array(i + grid.nx * (j + grid.ny * k), dtype=wp.int64, device=device.name),
        wp.array(inside.astype(np.float32), dtype=wp.vec3f, device=device.name),
        frame,
    )
    return placement, np.abs(local - inside).max(axis=1)


def _refuse_far(placement: Placement, volume: Volume) -> None:
    """Raise CallError if a vertex is far from the surface; one without a distance from it is none."""
    count = placement.cell.shape[0]
    farthest = measure_deviation(placement, volume, None).max_mm
    gaps = [0.0] if volume.slice_positions is None else np.diff(volume.slice_positions).tolist()
    limit = FARTHEST * max(*volume.spacing, *gaps)
    if count and (farthest is None or farthest > limit):
        found = "none that has a distance" if farthest is None else f"up to {farthest:.3g} mm"
        raise CallError(
            f"distances of the {count} vertices from the isosurface: {found}; expected up to {limit:.3g}"
            " mm, a spacing; pass the volume, isovalue and affine that the mesh was made with"
        )


def _orientation(mesh: Mesh, normals: Float32Array) -> float:
    """Return 1 if most of a mesh's faces, by area, look the way of their vertices' normals, else -1."""
    points, corners = mesh.positions.numpy(), mesh.faces.numpy()
    last = np.where(corners[:, 3] < 0, corners[:, 2], corners[:, 3])
    areas = np.cross(points[corners[:, 2]] - points[corners[:, 0]], points[last] - points[corners[:, 1]])
    return 1.0 if np.einsum("ij,ij->", areas, normals[corners[:, 0]], dtype=np.float64) >= 0 else -1.0


def _require_one_device(mesh: Mesh, volume: DeviceVolume) -> None:
    """Raise CallError unless it is a mesh and a volume on its device."""
    require_mesh(mesh)
    if not isinstance(volume, DeviceVolume) or volume.device.name != mesh.device.name:
        place = f" on {volume.device.name}" if isinstance(volume, DeviceVolume) else ""
        raise CallError(
            f"a {type(volume).__name__}{place} was found; expected a volume on {mesh.device.name}, as the"
            " mesh is; call upload_volume(volume, mesh.device) first"
        )


def _lacks_data(volume: Volume) -> bool:
    """Return whether nodes of a volume may be without data, slice by slice to keep memory small."""
    if volume.padding is not None:
        return True
    return volume.values.dtype.kind == "f" and not all(np.isfinite(plane).all() for plane in volume.values)
