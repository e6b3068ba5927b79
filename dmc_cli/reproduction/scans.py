"""Measure the scans of Schmitz et al. 2009 as their table I does, where the user has them.

Quads of dual contouring are split along the same diagonal everywhere: their mean is below that of any split
that looks at the shape. Particles make ten steps, their number being unknown.
"""

from collections.abc import Mapping

import numpy as np
import warp as wp

from dmc_cli.contouring import extract_surface, kernel_modules
from dmc_cli.errors import SettingsError
from dmc_cli.field import DeviceVolume, upload_volume
from dmc_cli.measures import measure_elements
from dmc_cli.mesh import Mesh
from dmc_cli.methods import METHODS
from dmc_cli.progress import SILENT, Progress
from dmc_cli.reproduction.paper_values import MACET, MARCHING, PARTICLE, MeshKind, Scan
from dmc_cli.reproduction.schmitz_table import SCANS
from dmc_cli.runtime import Device, load_kernels
from dmc_cli.settings import ReadSettings, SurfaceSettings
from dmc_cli.volume_io import read_volume

STEPS = 10
"""Of the particles."""


def measure_scans(
    device: Device, files: Mapping[str, str], progress: Progress = SILENT
) -> dict[tuple[str, MeshKind], dict[str, float]]:
    """Return what was found on each scan, by its name and the kind of mesh, then by quantity.

    Args:
        device: Where to work.
        files: Where each scan is, by its name in `SCANS`.
        progress: Who listens.
    """
    found = {}
    for name, path in files.items():
        with progress.stage(f"reproducing {name}"):
            volume = upload_volume(read_volume(path, ReadSettings()), device)
            for kind, settings in scan_settings(SCANS[name]).items():
                load_kernels(device, kernel_modules(settings, normals_too=False), progress)
                found[name, kind] = _measured(volume, settings)
    return found


def scan_settings(scan: Scan) -> dict[MeshKind, SurfaceSettings]:
    """Return the settings of each kind of mesh that there is a method for."""
    level = scan.isovalue
    wanted = {
        MARCHING: SurfaceSettings(isovalue=level, method="mc", triangulation="standard"),
        PARTICLE: SurfaceSettings(isovalue=level, method="dc", placement="particle", steps=STEPS),
    }
    if "macet" in METHODS:
        wanted[MACET] = SurfaceSettings(isovalue=level, method="macet")
    return wanted


def scan_files(given: tuple[str, ...]) -> dict[str, str]:
    """Return the files by the names of the scans, from `NAME=FILE` each.

    Raises:
        SettingsError: It is not written so, or there is no such scan, or it is given twice.
    """
    files: dict[str, str] = {}
    for each in given:
        name, equals, path = each.partition("=")
        if not equals or not path or name not in SCANS:
            raise SettingsError(f"scan is {each!r:.80}; expected NAME=FILE, NAME one of {', '.join(SCANS)}")
        if name in files:
            raise SettingsError(f"scan {name} is given twice; expected each once")
        files[name] = path
    return files


def split_along_first(mesh: Mesh) -> Mesh:
    """Return the triangles of a mesh of quads, all split along the diagonal from the first corner."""
    quads = mesh.faces.numpy()
    triangles = np.concatenate([quads, quads[:, [0, 2, 3, 3]]])
    triangles[:, 3] = -1
    faces = wp.array(triangles, dtype=wp.vec4i, device=mesh.device.name)
    return Mesh(mesh.positions, faces, mesh.device, triangle_count=len(triangles))


def _measured(volume: DeviceVolume, settings: SurfaceSettings) -> dict[str, float]:
    """Return the triangles of a mesh and their radius ratios."""
    mesh = extract_surface(volume, settings).mesh
    if mesh.triangle_count == 0:
        mesh = split_along_first(mesh)
    elements = measure_elements(mesh)
    return {
        "triangles": mesh.face_count,
        "radius_ratio_mean": elements.radius_ratio_mean or 0.0,
        "radius_ratio_min": elements.radius_ratio_min or 0.0,
    }
