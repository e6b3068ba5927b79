"""Methods of contouring beside VTK, scikit-image and Warp, from values in memory to a mesh in memory.

    python benchmarks/methods.py [--device cpu] [--rounds 5] [--fast] [--out NAME]

On two threads, kernels warm, without normals; each figure is the least of its rounds, in which all methods
and peers take turns. A last case cuts the head CT at sixteen isovalues: in one run that keeps the volume and
an index of its bricks, against runs that each begin with the values in memory. Adds a line to
benchmarks/results/NAME.jsonl and writes NAME.md anew.

Goals: mc 2.5 times as fast as vtkFlyingEdges3D on iWP 512 and the head, 1.5 times on the others; tmc at least
three quarters of mc's speed; nets 20 times as fast as Warp's; dc no slower than vtkFlyingEdges3D; macet 3
times as fast as scikit-image.
"""

import argparse
import time
import warnings
from collections.abc import Callable

import peers
from cases import CASES, Case
from history import record

from dmc_cli.contouring import extract_surface, kernel_modules
from dmc_cli.field import DeviceVolume, upload_volume
from dmc_cli.methods import METHODS
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume

SLOW_PEERS = ("iWP 256", "micro-CT, 85")
"""Cases on which peers run that take seconds."""

ISOVALUES = tuple(range(-500, 1100, 100))
"""Of the head CT, sixteen: from air to dense bone."""


def runs_of(case: Case, volume: Volume, device: Device) -> dict[str, Callable[[], object]]:
    """What takes turns on a case, by name: our methods, then the peers."""
    level = (case.isovalue - volume.intercept) / volume.slope
    uploaded = upload_volume(volume, device)

    def ours(method: str) -> Callable[[], object]:
        settings = SurfaceSettings(isovalue=case.isovalue, method=method)
        return lambda: extract_surface(uploaded, settings)

    runs = {method: ours(method) for method in METHODS}
    runs["vtkFlyingEdges3D"] = peers.flying_edges(volume, level)
    if case.name in SLOW_PEERS:
        runs["scikit-image"] = peers.scikit_image(volume, level)
        runs["IsoSurfaceNets"] = peers.surface_nets(volume, level)
    return runs


def least_times(runs: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Milliseconds of each, the least of rounds in which all take turns, after a first one that warms up."""
    least: dict[str, float] = {}
    for number in range(rounds + 1):
        for name, run in runs.items():
            start = time.perf_counter()
            run()
            elapsed = 1e3 * (time.perf_counter() - start)
            if number:
                least[name] = min(least.get(name, elapsed), elapsed)
    return least


def several_isovalues(volume: Volume, device: Device, rounds: int) -> dict[str, float]:
    """Milliseconds of sixteen surfaces, with an index of bricks and without, the least of the rounds."""

    def cut(uploaded: DeviceVolume) -> None:
        for isovalue in ISOVALUES:
            extract_surface(uploaded, SurfaceSettings(isovalue=float(isovalue)))

    return least_times(
        {
            "indexed": lambda: cut(upload_volume(volume, device, indexed=True)),
            "plain": lambda: cut(upload_volume(volume, device)),
        },
        rounds,
    )


def table_of(found: dict[str, dict[str, float]]) -> str:
    """A table in Markdown: a row a method or peer, a column a case, the ratio to vtkFlyingEdges3D behind."""
    names = list(dict.fromkeys(name for times in found.values() for name in times))
    lines = ["| ms (times as fast as vtkFlyingEdges3D) | " + " | ".join(found) + " |"]
    lines.append("| --- |" + " ---: |" * len(found))
    for name in names:
        cells = []
        for times in found.values():
            peer = times.get("vtkFlyingEdges3D")
            ratio = f" ({peer / times[name]:.2f})" if peer and name in times else ""
            cells.append(f"{times[name]:.1f}{ratio}" if name in times else "")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--fast", action="store_true", help="the small cases only")
    parser.add_argument("--out", help="name of the files in benchmarks/results")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", DeprecationWarning)
    device = select_device(chosen.device, peers.THREADS)
    for method in METHODS:
        modules = kernel_modules(
            SurfaceSettings(isovalue=0.0, method=method), normals_too=False, indexed=True
        )
        load_kernels(device, modules)
    found: dict[str, dict[str, float]] = {}
    for case in CASES:
        if chosen.fast and "512" in case.name:
            continue
        volume = case.load()
        if volume is None:
            continue
        found[case.name] = least_times(runs_of(case, volume, device), chosen.rounds)
        print(case.name, {name: round(ms, 1) for name, ms in found[case.name].items()}, flush=True)
        if case.name.startswith("head"):
            found["head CT, 16 isovalues"] = several_isovalues(volume, device, min(chosen.rounds, 3))
            print(found["head CT, 16 isovalues"], flush=True)
    table = table_of(found)
    print(table)
    if chosen.out:
        record(chosen.out, {"milliseconds": found}, "Methods of contouring beside other programs", table)


if __name__ == "__main__":
    main()
