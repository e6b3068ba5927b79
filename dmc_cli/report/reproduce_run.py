"""Make the papers' synthetic meshes again and measure them, for `dmc reproduce`."""

import time
from collections.abc import Iterable

from dmc_cli.device import Device, load_kernels
from dmc_cli.progress import SILENT, Progress
from dmc_cli.report.paper_tables import DMC, DataSet, MeshKind
from dmc_cli.report.reproduce import SyntheticMesh, measure_synthetic
from dmc_cli.report.twins import find_twins
from dmc_cli.settings import Placement, ReadSettings, SurfaceSettings
from dmc_cli.surface import Surface, extract_surface, kernel_modules, upload_volume
from dmc_cli.volume.synthetic import synthetic_volume


def measure_data_sets(
    device: Device,
    data_sets: Iterable[DataSet],
    placement: Placement = "exact",
    progress: Progress = SILENT,
) -> dict[tuple[str, MeshKind], dict[str, float]]:
    """Return what was found on each data set, by its name and the kind of mesh, then by quantity.

    Args:
        device: Where to work.
        data_sets: Which ones.
        placement: Where vertices go; the papers' figures are those of `sampled`, but for counts.
        progress: Who listens.
    """
    load_kernels(device, kernel_modules(normals_too=False, placement=placement), progress)
    found: dict[tuple[str, MeshKind], dict[str, float]] = {}
    for data in data_sets:
        with progress.stage(f"reproducing {data.name}"):
            surface, milliseconds = _extract(device, data, placement)
            found[data.name, DMC] = {
                **measure_synthetic(device, _plain_mesh(device, data, surface)),
                "crossed_edges": surface.counts.crossed_edges,
                "surface_ms": milliseconds,
            }
    return found


def _extract(device: Device, data: DataSet, placement: Placement) -> tuple[Surface, float]:
    """Return the surface as the papers cut it, open and with the asymptotic decider, and the time it took."""
    volume = synthetic_volume(f"synth:{data.field}:{data.nodes}", ReadSettings())
    uploaded = upload_volume(volume, device)
    settings = SurfaceSettings(isovalue=0.0, topology="asymptotic", placement=placement)
    start = time.perf_counter()
    surface = extract_surface(uploaded, settings)
    surface.quads.numpy()  # waits for a GPU
    return surface, 1e3 * (time.perf_counter() - start)


def _plain_mesh(device: Device, data: DataSet, surface: Surface) -> SyntheticMesh:
    """Return the surface's mesh as it is."""
    return SyntheticMesh(
        data=data,
        points=surface.vertices,
        cells=surface.vertex_cell.numpy(),
        locals=surface.vertex_local.numpy(),
        quads=surface.quads,
        twins=find_twins(device, surface.quads, surface.vertices.shape[0]),
        unused_vertices=surface.counts.unused_vertices,
    )
