"""A whole job of the library on devices that take the branches of other hardware: the same bytes by all."""

import hashlib
import json
import sys
from functools import cache

import numpy as np
import warp as wp

from dmc_cli.contouring import compute_normals, extract_surface
from dmc_cli.contouring.dual_contouring import placement
from dmc_cli.contouring.dual_grid import active_cells, cell_quads
from dmc_cli.contouring.dual_marching_cubes import quads, vertices
from dmc_cli.contouring.macet import moved_triangles, surface_steps
from dmc_cli.contouring.stages import cell_triangles, edge_ranks, edge_vertices
from dmc_cli.contouring.topological_marching_cubes import trilinear_cells
from dmc_cli.field import upload_volume
from dmc_cli.mesh.mesh import COLOR, COLOR24
from dmc_cli.processing.remeshing import remesh
from dmc_cli.report.measures import measure_surface
from dmc_cli.report.report import measured_sections
from dmc_cli.runtime.device import Device, select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.fields import smooth_noise, volume_of, white_noise
from tests.mesh.meshes import colored, relaxed, simplified


class AsOnGpu(Device):
    """The CPU as a device that is none: all that a GPU does otherwise, but for what is compiled for it."""

    @property
    def is_cpu(self) -> bool:
        """Whether kernels run on the CPU: as far as anybody can see, not."""
        return False


def with_holes() -> Volume:
    values = smooth_noise(22).values.copy()
    values[8:12, 5:20, 9:15] = np.nan
    return volume_of(values)


def uneven_slices() -> Volume:
    depths = np.cumsum(np.random.default_rng(4).uniform(0.5, 2.0, 22))
    affine = np.diag([0.7, 0.8, 1.1, 1.0])
    return volume_of(smooth_noise(22).values, affine=affine, slice_positions=depths - depths[0])


def small_integers() -> Volume:
    noise = np.random.default_rng(5).standard_normal((21, 22, 70)) * 40
    return volume_of(np.clip(noise, -100, 100).astype(np.int16), space="LPS", affine=np.diag([-1.0, 2, 3, 1]))


def ties() -> Volume:
    """Half of the ambiguous faces have equal products."""
    return volume_of(np.random.default_rng(8).integers(-2, 3, (13, 14, 40)).astype(np.float32))


def long_rows() -> Volume:
    """Many special cells, more than are flipped by one thread, and lists that NumPy does not go through."""
    return white_noise(34)


VOLUMES = {
    "smooth": (lambda: smooth_noise(22), {}),
    "holes": (with_holes, {"border": "closed"}),
    "integers": (small_integers, {"border": "closed", "inside": "below"}),
    "noise": (long_rows, {}),
    "not manifold": (lambda: white_noise(24), {"topology": "asymptotic"}),
    "uneven": (uneven_slices, {}),
    "nets": (with_holes, {"method": "nets", "border": "closed"}),
    "nets of integers": (small_integers, {"method": "nets", "inside": "below"}),
    "planes": (small_integers, {"method": "dc"}),
    "planes beside holes": (with_holes, {"method": "dc"}),
    "particles": (uneven_slices, {"method": "dc", "placement": "particle", "border": "closed"}),
    "paper's planes": (lambda: white_noise(24), {"method": "dc", "placement": "paper"}),
    "mc of noise": (long_rows, {"method": "mc"}),
    "mc of holes": (with_holes, {"method": "mc", "triangulation": "standard"}),
    "mc of integers": (small_integers, {"method": "mc", "border": "closed", "inside": "below"}),
    "mc between uneven slices": (uneven_slices, {"method": "mc"}),
    "macet of noise": (long_rows, {"method": "macet"}),
    "macet of holes": (with_holes, {"method": "macet"}),
    "macet of integers": (small_integers, {"method": "macet", "border": "closed", "inside": "below"}),
    "macet between uneven slices": (uneven_slices, {"method": "macet"}),
    "tmc of noise": (long_rows, {"method": "tmc"}),
    "tmc of holes": (with_holes, {"method": "tmc"}),
    "tmc of ties": (ties, {"method": "tmc", "border": "closed", "triangulation": "standard"}),
    "tmc between uneven slices": (uneven_slices, {"method": "tmc", "inside": "below"}),
}

REMESHED = ("smooth", "holes")
"""The others have so many irregular vertices that it takes long."""


@cache
def volume_named(name: str) -> Volume:
    return VOLUMES[name][0]()


def bytes_of(name: str, device: Device) -> dict[str, bytes]:
    """What each stage makes of a volume on a device."""
    volume, chosen = volume_named(name), SurfaceSettings(isovalue=0.0, **VOLUMES[name][1])
    surface = extract_surface(upload_volume(volume, device), chosen)
    found = {
        "vertices and quads": arrays_of(surface),
        "normals": compute_normals(surface.placement, chosen).numpy().tobytes(),
        "counts": repr(surface.counts).encode(),
    }
    if chosen.topology != "manifold":
        return found
    mesh = colored(surface)
    found |= {key: mesh.mesh.face_values[key].numpy().tobytes() for key in (COLOR, COLOR24)}
    found["twins"] = mesh.mesh.halfedges.twin.numpy().tobytes()
    found["measures"] = measures_of(mesh, volume)
    result = simplified(mesh)
    found["simplified"] = everything_of(result)
    if name in REMESHED:
        more = remesh(result.mesh, result.placement, 2)
        found["remeshed"] = everything_of(more) + more.mesh.face_values[COLOR].numpy().tobytes()
        found["remeshed measures"] = measures_of(more, volume)
    found["relaxed"] = everything_of(relaxed(result, 3))
    return found


def arrays_of(surface) -> bytes:
    mesh, placement = surface.mesh, surface.placement
    arrays = [mesh.positions, mesh.faces, placement.cell, placement.local]
    return b"".join(array.numpy().tobytes() for array in arrays)


def everything_of(result) -> bytes:
    return arrays_of(result) + result.mesh.halfedges.twin.numpy().tobytes()


def measures_of(result, volume) -> bytes:
    return json.dumps(
        measured_sections(measure_surface(result.mesh, result.placement, volume, intersections=True))
    ).encode()


def surface_hash(name: str) -> str:
    volume, device = volume_named(name), select_device("cpu", 2)
    chosen = SurfaceSettings(isovalue=0.0, **VOLUMES[name][1])
    return hashlib.sha256(arrays_of(extract_surface(upload_volume(volume, device), chosen))).hexdigest()


if __name__ == "__main__":
    # what lists bits, compiled with other flags; the hashes of some surfaces
    ours = [vertices, quads, active_cells, cell_quads, placement, cell_triangles, edge_ranks, edge_vertices]
    ours += [moved_triangles, surface_steps, trilinear_cells]
    for module in ours:
        wp.get_module(module.__name__).options["cpu_compiler_flags"] = sys.argv[1]
    for name in sys.argv[2:]:
        print(surface_hash(name))
