"""Memory that surface extraction, or the whole mesh pipeline, takes beside the volume and the results.

    python benchmarks/memory.py [FIELD] [N] [--out NAME] the surface
    python benchmarks/memory.py --pipeline [FIELD] [N]   to a simplified mesh with normals, as in mesh.py
    python benchmarks/memory.py --pipeline head          the same of the head CT, if it is there

The peak of resident memory of a fresh process, less what was resident before with kernels loaded and the
volume touched, less the arrays of the result. The goals are one byte a node for the surface, and two bytes a
node and 40 bytes a quad for the pipeline. Adds a line to benchmarks/results/NAME.jsonl.
"""

import argparse
import os
import subprocess

from cases import CASES
from history import record

from dmc_cli.contouring import color_faces, compute_normals, connect_faces, extract_surface, kernel_modules
from dmc_cli.field import upload_volume
from dmc_cli.processing import kernel_modules as mesh_kernels, simplify
from dmc_cli.runtime import load_kernels, select_device
from dmc_cli.settings import MeshSettings, ReadSettings, SurfaceSettings
from dmc_cli.system import peak_memory
from dmc_cli.volume_io import read_volume


def resident() -> int:
    """Return the bytes of this process that are in memory now."""
    told = subprocess.run(
        ["ps", "-o", "rss=", "-p", str(os.getpid())], capture_output=True, text=True, check=True
    )
    return int(told.stdout) * 1024


def run(volume, isovalue: float, device, *, pipeline: bool) -> tuple[int, list]:
    """Return the number of quads before simplification and the arrays of the result."""
    settings = SurfaceSettings(isovalue=isovalue)
    surface = extract_surface(upload_volume(volume, device), settings)
    quads = surface.mesh.face_count
    if not pipeline:
        return quads, arrays_of(surface)
    surface = color_faces(connect_faces(surface))
    result = simplify(surface.mesh, surface.placement, MeshSettings(simplify="all"))
    return quads, [*arrays_of(result), compute_normals(result.placement, settings)]


def arrays_of(surface) -> list:
    mesh, placement = surface.mesh, surface.placement
    return [mesh.positions, placement.local, placement.cell, mesh.faces]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("field", nargs="?", default="iwp")
    parser.add_argument("nodes", nargs="?", type=int, default=512)
    parser.add_argument("--pipeline", action="store_true")
    parser.add_argument("--out", help="name of the history")
    options = parser.parse_args()
    device = select_device("cpu", 2)
    load_kernels(device, kernel_modules(SurfaceSettings(isovalue=0.0)) + mesh_kernels(simplify=True))
    run(read_volume("synth:iwp:16", ReadSettings()), 0.0, device, pipeline=options.pipeline)
    named = next((case for case in CASES if case.name.startswith(options.field)), None)
    volume = named.load() if named else read_volume(f"synth:{options.field}:{options.nodes}", ReadSettings())
    volume.values.max()
    before = resident()
    quads, arrays = run(volume, named.isovalue if named else 0.0, device, pipeline=options.pipeline)
    peak = peak_memory() or 0
    results = sum(array.numpy().nbytes for array in arrays)
    beside, count = peak - before - results, volume.values.size
    allowed = 2 * count + 40 * quads if options.pipeline else count
    print(f"{options.field} {volume.shape}: {quads} quads, results {results / 2**20:.0f} MiB")
    print(f"beside volume and results: {beside / 2**20:.0f} MiB, {beside / count:.2f} bytes a node")
    print(f"allowed: {allowed / 2**20:.0f} MiB")
    if options.out:
        what = {"field": options.field, "shape": volume.shape, "pipeline": options.pipeline, "quads": quads}
        record(options.out, what | {"results": results, "beside": beside, "allowed": allowed})


if __name__ == "__main__":
    main()
