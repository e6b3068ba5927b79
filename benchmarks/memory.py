"""Memory that surface extraction takes beside the volume and the output arrays, in bytes a node.

    python benchmarks/memory.py [FIELD] [N]

The peak of resident memory of a fresh process, less what was resident before with kernels loaded and the
volume touched, less the output arrays. The goal is at most one byte a node.
"""

import resource
import sys
from pathlib import Path

from dmc_cli.device import load_kernels, select_device
from dmc_cli.settings import ReadSettings, SurfaceSettings
from dmc_cli.surface import extract_surface, kernel_modules, upload_volume
from dmc_cli.volume.read import read_volume

UNIT = 1 if sys.platform == "darwin" else 1024


def resident() -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmRSS"))


def main() -> None:
    field = sys.argv[1] if len(sys.argv) > 1 else "iwp"
    nodes = int(sys.argv[2]) if len(sys.argv) > 2 else 512
    device = select_device("cpu", 2)
    load_kernels(device, kernel_modules())
    small = read_volume(f"synth:{field}:16", ReadSettings())
    extract_surface(upload_volume(small, device), SurfaceSettings(isovalue=0.0))
    volume = read_volume(f"synth:{field}:{nodes}", ReadSettings())
    before = resident()
    surface = extract_surface(upload_volume(volume, device), SurfaceSettings(isovalue=0.0))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * UNIT
    arrays = (surface.vertices, surface.vertex_local, surface.vertex_cell, surface.quads)
    outputs = sum(array.numpy().nbytes for array in arrays)
    beside = peak - before - outputs
    count = volume.values.size
    print(f"{field} {nodes}: {surface.quads.shape[0]} quads, outputs {outputs / 2**20:.0f} MiB")
    print(f"beside volume and outputs: {beside / 2**20:.0f} MiB, {beside / count:.2f} bytes a node")


if __name__ == "__main__":
    main()
