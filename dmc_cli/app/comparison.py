"""Compare methods of contouring on one surface: counts, time, memory, shape, topology, deviation.

Every method extracts the same surface of the same volume in memory, on the same threads, with nothing else
between. Euler characteristics are held against that of the trilinear surface, which topologically correct
marching cubes has.
"""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import warp as wp

from dmc_cli.app.closed_tunnels import ClosedTunnels, find_closed_tunnels
from dmc_cli.app.no_surface import no_surface
from dmc_cli.app.preparation import resolved_isovalue, settle_isovalue
from dmc_cli.app.read_ahead import ReadAhead
from dmc_cli.contouring import (
    connect_faces,
    extract_surface,
    kernel_modules as surface_kernels,
    mesh_kernel_modules,
)
from dmc_cli.field import DeviceVolume, upload_volume
from dmc_cli.measures import kernel_modules as report_kernels, measure_topology, plain
from dmc_cli.mesh import Mesh, Placement, connect
from dmc_cli.methods import METHODS
from dmc_cli.notices import warning_keys
from dmc_cli.processing import kernel_modules as processing_kernels, simplify
from dmc_cli.progress import SILENT, Progress
from dmc_cli.report import (
    SCHEMA,
    Measures,
    collect_versions,
    input_section,
    measure_surface,
    measured_sections,
)
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import (
    SIMPLIFIED,
    CompareSettings,
    ConvertSettings,
    MeshSettings,
    OutputSettings,
    Simplify,
    SurfaceSettings,
)
from dmc_cli.volume import Volume, intact

EXACT = "tmc"
"""The method whose mesh has the topology of the trilinear surface."""

PASSES: tuple[tuple[str, Simplify], ...] = (
    ("before", "none"),
    ("after 3-X-3-Y", "3x3y"),
    ("after 3-3-3-3", "all"),
)
"""What is told after each pass of simplification, and which patterns are gone then."""


@dataclass(frozen=True, kw_only=True)
class Compared:
    """A method's surface.

    Attributes:
        method: Its name, as in `CompareSettings.methods`.
        mesh: Its mesh, connected.
        placement: Where its vertices lie.
        measures: What was measured of it.
        surface_ms: The least time of extraction, with simplification where that is asked for, in
            milliseconds.
        memory_bytes: The most that arrays took at the same time while it was extracted, the mesh with them
            and the volume not; None on CUDA.
        closed: Tunnels of the trilinear surface that the mesh does not have; None if not known.
    """

    method: str
    mesh: Mesh
    placement: Placement
    measures: Measures
    surface_ms: float
    memory_bytes: int | None
    closed: ClosedTunnels | None


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Methods beside each other on one volume.

    Attributes:
        volume: The volume.
        settings: What was compared.
        methods: One for each method, in their order.
        exact_euler: The Euler characteristic of the trilinear surface; None where no method tells it.
        choice: How the isovalue was chosen, None where it was given as a number.
    """

    volume: Volume
    settings: CompareSettings
    methods: tuple[Compared, ...]
    exact_euler: int | None
    choice: dict[str, Any] | None = None

    def rows(self) -> list[dict[str, Any]]:
        """Return a table: a dict of plain values for each method."""
        fastest = min(each.surface_ms for each in self.methods)
        return [_row(each, fastest, self.exact_euler) for each in self.methods]

    def report(self) -> dict[str, Any]:
        """Return the report: the rows with all that is known of each mesh, and what was compared, where."""
        tunnels, device = self.tunnels(), self.methods[0].mesh.device
        settings = asdict(self.settings)
        settings |= settings.pop("read") | {"device": device.name, "threads": device.threads}
        return {
            "schema": SCHEMA,
            **warning_keys(self.volume.warnings),
            "input": plain(input_section(self.volume, with_hash=True)),
            "settings": settings | resolved_isovalue(self.choice),
            "choice": self.choice,
            "euler_characteristic": self.exact_euler,
            "methods": [
                row | {"tunnels": tunnels.get(each.method)} | plain(measured_sections(each.measures))
                for row, each in zip(self.rows(), self.methods, strict=True)
            ],
            "versions": collect_versions(device.name),
        }

    def tunnels(self) -> dict[str, list[dict[str, Any]]]:
        """Return where each method closes tunnels of the trilinear surface, if that is known of it."""
        return {
            each.method: each.closed.places(self.volume) for each in self.methods if each.closed is not None
        }


def compare_methods(settings: CompareSettings, progress: Progress = SILENT) -> Comparison:
    """Extract and measure the surface of a volume by each method.

    Raises:
        DmcError: What went wrong, by class.
    """
    ahead = ReadAhead(_reading(settings))
    device = select_device(settings.device, settings.threads)
    wanted = [settings.surface_of(method) for method in settings.methods]
    exact = settings.surface_of(EXACT) if EXACT in METHODS else None
    extracted = [*wanted, exact] if exact else wanted
    modules = [module for each in extracted for module in surface_kernels(each, normals_too=False)]
    modules += [module for each in wanted for module in mesh_kernel_modules(each.method)]
    modules += processing_kernels(simplify=any(each.endswith(SIMPLIFIED) for each in settings.methods))
    modules += report_kernels(intersections=True)
    load_kernels(device, list(dict.fromkeys(modules)), progress)
    with progress.stage("reading"):
        volume = ahead.result(progress)
    with intact(volume.values, settings.input):
        contoured, isovalue, choice = settle_isovalue(volume, settings.isovalue)
        settings = replace(settings, isovalue=isovalue)
        exact = settings.surface_of(EXACT) if exact else None
        times = _least_times(contoured, settings, device, progress)
        compared = []
        for number, method in enumerate(settings.methods):
            with progress.stage(f"measuring {method}"):
                compared.append(_compared(method, contoured, settings, device, times[method]))
            progress.advance((number + 1) / len(settings.methods))
        euler = _exact_euler(compared, contoured, exact, device)
    return Comparison(
        volume=volume, settings=settings, methods=tuple(compared), exact_euler=euler, choice=choice
    )


def _least_times(
    volume: Volume, settings: CompareSettings, device: Device, progress: Progress
) -> dict[str, float]:
    """Return the least milliseconds of each method, which take turns, so that all meet the same load."""
    uploaded = upload_volume(volume, device)
    least = dict.fromkeys(settings.methods, float("inf"))
    for number in range(settings.repeats + 1):  # the first one warms up
        for method in settings.methods:
            with progress.stage(f"timing {method}"):
                start = time.perf_counter()
                mesh, _ = _made(method, uploaded, settings)
                wp.synchronize()
                elapsed = 1e3 * (time.perf_counter() - start)
            if not mesh.face_count:
                raise no_surface(volume, settings.surface_of(method).settled_isovalue)
            if number:
                least[method] = min(least[method], elapsed)
    return least


def _reading(settings: CompareSettings) -> ConvertSettings:
    """Return the conversion whose input is read, which never happens as a whole."""
    return ConvertSettings(
        input=settings.input,
        read=settings.read,
        surface=settings.surface_of(settings.methods[0]),
        output=OutputSettings(path="compared.ply", dry_run=True),
        device=settings.device,
        threads=settings.threads,
    )


def _compared(
    method: str, volume: Volume, settings: CompareSettings, device: Device, surface_ms: float
) -> Compared:
    """Make a method's mesh and measure it."""
    own = replace(device)  # which counts its own arrays
    uploaded = upload_volume(volume, own)
    mesh, placement = _made(method, uploaded, settings)
    most = own.most_in_use
    mesh = connect(mesh)
    return Compared(
        method=method,
        mesh=mesh,
        placement=placement,
        measures=measure_surface(mesh, placement, volume, intersections=True),
        surface_ms=surface_ms,
        memory_bytes=most,
        closed=find_closed_tunnels(uploaded, settings.surface_of(method)),
    )


def _made(method: str, volume: DeviceVolume, settings: CompareSettings) -> tuple[Mesh, Placement]:
    """Return the mesh of a method and where its vertices lie."""
    surface = extract_surface(volume, settings.surface_of(method))
    if not method.endswith(SIMPLIFIED):
        return surface.mesh, surface.placement
    surface = connect_faces(surface)
    result = simplify(surface.mesh, surface.placement, MeshSettings(simplify="all"))
    return result.mesh, result.placement


def valences_of_passes(comparison: Comparison) -> dict[str, dict[int, int]]:
    """Return how many vertices have which valence before simplification and after each of its passes.

    Of the first method that is compared simplified; nothing without one.
    """
    settings = comparison.settings
    method = next((each for each in settings.methods if each.endswith(SIMPLIFIED)), None)
    if method is None:
        return {}
    device = comparison.methods[0].mesh.device
    volume = upload_volume(comparison.volume, device)
    found: dict[str, dict[int, int]] = {}
    for label, patterns in PASSES:
        surface = connect_faces(extract_surface(volume, settings.surface_of(method)))
        mesh = surface.mesh
        if patterns != "none":
            mesh = simplify(mesh, surface.placement, MeshSettings(simplify=patterns)).mesh
        found[label] = dict(measure_topology(mesh).valence_histogram)
    return found


def _exact_euler(
    compared: Sequence[Compared], volume: Volume, exact: SurfaceSettings | None, device: Device
) -> int | None:
    """Return the Euler characteristic of the trilinear surface, None where no method has it."""
    if exact is None:
        return None
    for each in compared:
        if each.method == EXACT:
            return each.measures.topology.euler_characteristic
    return measure_topology(extract_surface(upload_volume(volume, device), exact).mesh).euler_characteristic


def _row(each: Compared, fastest: float, exact_euler: int | None) -> dict[str, Any]:
    """Return what the table has of a method."""
    mesh, topology = each.mesh, each.measures.topology
    closed = each.closed
    quality, elements, deviation = each.measures.quality, each.measures.elements, each.measures.deviation
    return {
        "method": each.method,
        "vertices": mesh.vertex_count,
        "quads": mesh.face_count - mesh.triangle_count,
        "triangles": mesh.triangle_count,
        "surface_ms": round(each.surface_ms, 3),
        "time_ratio": round(each.surface_ms / fastest, 3),
        "memory_bytes": each.memory_bytes,
        "deviation_mean": deviation.mean,
        "deviation_max": deviation.max,
        "deviation_mean_mm": deviation.mean_mm,
        "deviation_max_mm": deviation.max_mm,
        "shape_mean": quality.shape_mean,
        "shape_min": quality.shape_min,
        "mean_ratio_mean": quality.mean_ratio_mean,
        "radius_ratio_mean": elements.radius_ratio_mean,
        "radius_ratio_min": elements.radius_ratio_min,
        "min_angle": quality.min_angle,
        "irregular_percent": topology.irregular_percent,
        "non_manifold_edges": topology.non_manifold_edges,
        "non_manifold_vertices": topology.non_manifold_vertices,
        "self_intersections": each.measures.self_intersections,
        "components": topology.components,
        "euler_characteristic": topology.euler_characteristic,
        "euler_difference": None if exact_euler is None else topology.euler_characteristic - exact_euler,
        "tunnels_closed": None if closed is None else len(closed.cells),
        "flipped_faces": None if closed is None else len(closed.faces),
    }
