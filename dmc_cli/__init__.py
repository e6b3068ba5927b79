"""From a scan to a quad mesh: dual marching cubes on NVIDIA Warp.

The data flow is the package. Whoever reads the folders in this order meets the method's steps in theirs; each
says in its `__init__.py` what it is for and in which order to read it:

    settings       every choice there is, with its default
    setting_types  what a setting may be, as its annotation says
    errors         every error that is raised on purpose
    progress       who is told how far a run is
    stop           how work in threads is asked to stop
    threads        work in threads, as many as the system gives
    version        which version this is
    system         what one operating system has and another lacks
    memory_limits  what this process may still take
    printable      texts from outside without what a terminal would obey
    volume         values on a grid and where they lie in the world
    volume_io      volumes in files, a format a file or a folder
    runtime        where kernels run, the threads that share a launch, memory
    bits           words of bits
    field          the grid and the function between its nodes
    mesh           connectivity, renumbering, invariants
    contouring     from a volume to a surface mesh, a folder a method
    processing     algorithms on a mesh: patterns, relaxation, remeshing
    measures       topology, quality, deviation, of any mesh
    report         what a run found, as JSON, and what is required of it
    files          outputs that are complete or not there at all
    mesh_io        meshes in files, a format a file
    reproduction   the papers' tables, made again
    app            what a command does: convert, batch, measure
    cli            the command line, the only place that knows click

The names below are what other programs may rely on. They are imported when they are first used, so that
`import dmc_cli` and `dmc --help` stay light.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dmc_cli.app.convert import ConvertResult, convert
    from dmc_cli.app.measure_file import measure_file
    from dmc_cli.contouring import Surface, extract_surface, upload_volume
    from dmc_cli.errors import DmcError
    from dmc_cli.mesh_io.mesh_file import MeshFile
    from dmc_cli.mesh_io.read import read_mesh
    from dmc_cli.mesh_io.write import write_mesh
    from dmc_cli.runtime.device import select_device
    from dmc_cli.settings import (
        ConvertSettings,
        MeasureSettings,
        MeshSettings,
        OutputSettings,
        ReadSettings,
        SurfaceSettings,
    )
    from dmc_cli.volume.volume import Volume
    from dmc_cli.volume_io.read import read_volume

_HOMES = {
    "ConvertResult": "app.convert",
    "ConvertSettings": "settings",
    "DmcError": "errors",
    "MeasureSettings": "settings",
    "MeshFile": "mesh_io.mesh_file",
    "MeshSettings": "settings",
    "OutputSettings": "settings",
    "ReadSettings": "settings",
    "Surface": "contouring",
    "SurfaceSettings": "settings",
    "Volume": "volume.volume",
    "convert": "app.convert",
    "extract_surface": "contouring",
    "measure_file": "app.measure_file",
    "read_mesh": "mesh_io.read",
    "read_volume": "volume_io.read",
    "select_device": "runtime.device",
    "upload_volume": "contouring",
    "write_mesh": "mesh_io.write",
}
"""The module that each public name comes from."""

__all__ = [
    "ConvertResult",
    "ConvertSettings",
    "DmcError",
    "MeasureSettings",
    "MeshFile",
    "MeshSettings",
    "OutputSettings",
    "ReadSettings",
    "Surface",
    "SurfaceSettings",
    "Volume",
    "convert",
    "extract_surface",
    "measure_file",
    "read_mesh",
    "read_volume",
    "select_device",
    "upload_volume",
    "write_mesh",
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
