"""From a scan to a quad mesh: dual marching cubes on NVIDIA Warp.

The data flow is the package. Whoever reads the files in this order meets the method's steps in theirs:

    settings     every choice there is, with its default
    setting_types  what a setting may be, as its annotation says
    errors       every error that is raised on purpose
    threads      work in threads, as many as the system gives
    system       what one operating system has and another lacks
    printable    texts from outside without what a terminal would obey
    progress     who is told how far a run is
    volume       values on a grid and where they lie in the world; readers for each format
    read_ahead   the volume is read while kernels are loaded
    host_memory  memory that is kept for the next array
    runtime      the CPU threads that share a launch, how they are stopped, the kernels on disk
    scan         the prefix sum of a long array, by all threads
    device       where kernels run, and the one way to launch them
    surface      from the volume to vertices and quads: inside, cells, polygons, vertices, quads, normals
    mesh         halfedges, colours, simplification, smoothing, checks
    report       topology, quality, deviation; the papers' tables
    writers      mesh and volume files, complete or not at all
    memory       the forecast that is held against a budget
    memory_limits  what this process may still take
    file_keys    what a file is known by, whatever its path
    overlaps     no output is an input or another output
    pipeline     the table of contents: one call a stage
    batch        many conversions, side by side
    cli          the command line, the only place that knows click

The names below are what other programs may rely on. They are imported when they are first used, so that
`import dmc_cli` and `dmc --help` stay light.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dmc_cli.device import select_device
    from dmc_cli.errors import DmcError
    from dmc_cli.pipeline import ConvertResult, convert
    from dmc_cli.report.measure import measure_file
    from dmc_cli.settings import (
        ConvertSettings,
        MeasureSettings,
        MeshSettings,
        OutputSettings,
        ReadSettings,
        SurfaceSettings,
    )
    from dmc_cli.surface import Surface, extract_surface, upload_volume
    from dmc_cli.volume.read import read_volume
    from dmc_cli.volume.volume import Volume

_HOMES = {
    "ConvertResult": "pipeline",
    "ConvertSettings": "settings",
    "DmcError": "errors",
    "MeasureSettings": "settings",
    "MeshSettings": "settings",
    "OutputSettings": "settings",
    "ReadSettings": "settings",
    "Surface": "surface",
    "SurfaceSettings": "settings",
    "Volume": "volume.volume",
    "convert": "pipeline",
    "extract_surface": "surface",
    "measure_file": "report.measure",
    "read_volume": "volume.read",
    "select_device": "device",
    "upload_volume": "surface",
}
"""The module that each public name comes from."""

__all__ = [
    "ConvertResult",
    "ConvertSettings",
    "DmcError",
    "MeasureSettings",
    "MeshSettings",
    "OutputSettings",
    "ReadSettings",
    "Surface",
    "SurfaceSettings",
    "Volume",
    "convert",
    "extract_surface",
    "measure_file",
    "read_volume",
    "select_device",
    "upload_volume",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its home."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*globals(), *__all__})
