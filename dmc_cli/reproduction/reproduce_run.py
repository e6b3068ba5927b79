"""Make the papers' synthetic meshes again and measure them, for `dmc reproduce`.

The papers' way: open border, asymptotic decider, and in simplification their bare rules with merged vertices
left where they are. Times are those of one run with the kernels loaded and warm.
"""

import time
from collections.abc import Callable, Iterable
from typing import TypeVar

from dmc_cli.contouring import (
    Surface,
    color_faces,
    connect_faces,
    extract_surface,
    kernel_modules as surface_kernels,
    mesh_kernel_modules,
)
from dmc_cli.errors import SettingsError
from dmc_cli.field import DeviceVolume, upload_volume
from dmc_cli.measures import kernel_modules as report_kernels
from dmc_cli.mesh import Mesh, Placement
from dmc_cli.processing import kernel_modules as processing_kernels, simplify
from dmc_cli.progress import SILENT, Progress
from dmc_cli.reproduction.paper_tables import PAPER_VALUES
from dmc_cli.reproduction.paper_values import (
    DMC,
    DMCS,
    DUAL,
    MARCHING,
    TOPOLOGICAL,
    DataSet,
    MeshKind,
    PaperValue,
)
from dmc_cli.reproduction.reproduce import Row, SyntheticMesh, compare_tables, measure_synthetic
from dmc_cli.reproduction.scans import measure_scans, scan_files
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import MeshSettings, ReadSettings, ReproduceSettings, SurfaceSettings
from dmc_cli.volume_io import synthetic_volume

WARM_UP = DataSet(field="genus_two", nodes=32)
"""Made first, its times thrown away: the first launches of a process take longer."""

PAPER_RULES = MeshSettings(simplify="all", simplify_rules="paper", project=False)

OTHERS: dict[MeshKind, SurfaceSettings] = {
    MARCHING: SurfaceSettings(isovalue=0.0, method="mc", triangulation="standard"),
    TOPOLOGICAL: SurfaceSettings(isovalue=0.0, method="tmc", triangulation="standard"),
    DUAL: SurfaceSettings(isovalue=0.0, method="dc", placement="paper"),
}
"""The methods that the papers compare with, as they describe them."""

Result = TypeVar("Result")


def reproduce_tables(settings: ReproduceSettings, progress: Progress = SILENT) -> list[Row]:
    """Return the rows of the papers' tables with what was found, as `dmc reproduce` shows them.

    Raises:
        DeviceError: There is no such device, or not enough memory on it.
        SettingsError: No data set of the tables is small enough.
        DmcError: A scan cannot be read, by class.
    """
    files = scan_files(settings.scans)
    wanted = wanted_values(settings)
    device = select_device(settings.device, settings.threads)
    synthetic = {value.data for value in wanted if isinstance(value.data, DataSet)}
    data_sets = sorted(synthetic, key=lambda data: (data.nodes, data.field))
    found = measure_data_sets(device, data_sets, settings.placement, progress) if data_sets else {}
    scans = {value.data.name for value in wanted} & {*files}
    found |= measure_scans(device, {name: files[name] for name in files if name in scans}, progress)
    return compare_tables(found, wanted)


def wanted_values(settings: ReproduceSettings) -> list[PaperValue]:
    """Return the printed figures that the settings choose.

    Raises:
        SettingsError: There is none.
    """
    of_tables = [value for value in PAPER_VALUES if not settings.table or str(value.table) in settings.table]
    wanted = [value for value in of_tables if value.data.nodes <= settings.up_to]
    if not wanted:
        least = min(value.data.nodes for value in of_tables)
        raise SettingsError(
            f"up_to is {settings.up_to}, but the smallest data set of what is asked for has {least} nodes an"
            " axis; give that or more"
        )
    return wanted


def measure_data_sets(
    device: Device,
    data_sets: Iterable[DataSet],
    placement: str = "sampled",
    progress: Progress = SILENT,
) -> dict[tuple[str, MeshKind], dict[str, float]]:
    """Return what was found on each data set, by its name and the kind of mesh, then by quantity.

    Args:
        device: Where to work.
        data_sets: Which ones.
        placement: Where vertices go; the papers' figures are those of `sampled`, but for counts.
        progress: Who listens.
    """
    load_reproduction(device, placement, progress)
    _measure_data_set(device, WARM_UP, placement)
    found: dict[tuple[str, MeshKind], dict[str, float]] = {}
    for data in data_sets:
        with progress.stage(f"reproducing {data.name}"):
            found |= _measure_data_set(device, data, placement)
    return found


def load_reproduction(device: Device, placement: str, progress: Progress = SILENT) -> None:
    """Load the kernels of all methods that the papers of 2020 and 2021 have."""
    surface = papers_settings(placement)
    modules = [
        *surface_kernels(surface, normals_too=False),
        *mesh_kernel_modules(surface.method, colors=True),
        *processing_kernels(simplify=True),
        *report_kernels(intersections=False),
    ]
    for other in OTHERS.values():
        modules += surface_kernels(other, normals_too=False) + mesh_kernel_modules(other.method)
    load_kernels(device, list(dict.fromkeys(modules)), progress)


def _measure_data_set(
    device: Device, data: DataSet, placement: str
) -> dict[tuple[str, MeshKind], dict[str, float]]:
    """Return what was found on the mesh of a data set, as it is and simplified."""
    uploaded = upload_volume(synthetic_volume(f"synth:{data.field}:{data.nodes}", ReadSettings()), device)
    surface, surface_ms = _timed(lambda: _extract(uploaded, placement))
    unused, crossed = surface.counts.unused_vertices or 0, surface.counts.crossed_edges or 0
    surface, halfedges_ms = _timed(lambda: connect_faces(surface))
    surface, coloring_ms = _timed(lambda: color_faces(surface))
    plain = {
        **measure_synthetic(_synthetic(data, surface.mesh, surface.placement, unused)),
        "crossed_edges": crossed,
        "surface_ms": surface_ms,
        "halfedges_ms": halfedges_ms,
        "coloring_ms": coloring_ms,
    }
    # takes over the arrays of the surface
    result, simplify_ms = _timed(lambda: simplify(surface.mesh, surface.placement, PAPER_RULES))
    simplified = {
        **measure_synthetic(_synthetic(data, result.mesh, result.placement, 0)),
        "removed_3x3y": sum(result.removed_3x3y),
        "removed_3333": result.removed_3333,
        "simplify_ms": simplify_ms,
    }
    branches = 100.0 * (surface.counts.multi_polygon_cells or 0) / (surface.counts.active_cells or 1)
    others = {(data.name, kind): _measure_other(data, uploaded, other) for kind, other in OTHERS.items()}
    others[data.name, DUAL]["several_branches_percent"] = branches
    return {(data.name, DMC): plain, (data.name, DMCS): simplified, **others}


def _measure_other(data: DataSet, volume: DeviceVolume, settings: SurfaceSettings) -> dict[str, float]:
    """Return what was found on the mesh of a method that the papers compare with."""
    surface, surface_ms = _timed(lambda: extract_surface(volume, settings))
    unused = surface.counts.unused_vertices or 0
    surface = connect_faces(surface)
    found = measure_synthetic(_synthetic(data, surface.mesh, surface.placement, unused))
    return found | {"surface_ms": surface_ms}


def _timed(stage: Callable[[], Result]) -> tuple[Result, float]:
    """Return what a stage returns, and the milliseconds that it took, a GPU's work included."""
    import warp as wp

    start = time.perf_counter()
    result = stage()
    wp.synchronize()
    return result, 1e3 * (time.perf_counter() - start)


def _extract(volume: DeviceVolume, placement: str) -> Surface:
    """Return the surface as the papers cut it."""
    return extract_surface(volume, papers_settings(placement))


def papers_settings(placement: str) -> SurfaceSettings:
    """Return the papers' settings: an open border and the asymptotic decider."""
    return SurfaceSettings(isovalue=0.0, topology="asymptotic", placement=placement)


def _synthetic(data: DataSet, mesh: Mesh, placement: Placement, unused_vertices: int) -> SyntheticMesh:
    """Return a mesh for the measures."""
    return SyntheticMesh(
        data=data,
        mesh=mesh,
        placement=placement,
        unused_vertices=unused_vertices,
    )
