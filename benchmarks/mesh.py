"""Volume in memory to a simplified mesh with normals, beside vtkFlyingEdges3D alone with normals.

    python benchmarks/mesh.py [--device cpu] [--rounds 5] [--out NAME]

Surface, halfedges, colouring, simplification (both patterns, safe rules, vertices back on the surface,
colours kept proper) and normals, in one run on two threads with kernels warm. Rounds are interleaved; each
figure is the least of its rounds. The goal is a ratio of 1. Adds a line to benchmarks/results/NAME.jsonl and
writes NAME.md anew.
"""

import argparse
import time
import warnings

import peers
import warp as wp
from cases import CASES
from history import record

from dmc_cli.contouring import color_faces, compute_normals, connect_faces, extract_surface
from dmc_cli.field import stored_isovalue, upload_volume
from dmc_cli.processing import simplify
from dmc_cli.runtime import select_device
from dmc_cli.settings import MeshSettings, SurfaceSettings

STAGES = ("surface", "halfedges", "coloring", "simplify", "normals")
SIMPLIFY = MeshSettings(simplify="all")


def stages_of(uploaded, settings: SurfaceSettings) -> tuple[dict[str, float], dict[str, int]]:
    """Run every stage once; seconds by stage, and counts."""
    ends = [time.perf_counter()]

    def ended() -> None:
        wp.synchronize()
        ends.append(time.perf_counter())

    surface = extract_surface(uploaded, settings)
    quads = surface.mesh.face_count
    ended()
    surface = connect_faces(surface)
    ended()
    surface = color_faces(surface)
    ended()
    result = simplify(surface.mesh, surface.placement, SIMPLIFY)
    ended()
    compute_normals(result.placement, settings)
    ended()
    seconds = {stage: ends[n + 1] - ends[n] for n, stage in enumerate(STAGES)}
    return seconds, {"quads": quads, "quads_after": result.mesh.face_count}


def measure(volume, isovalue: float, device, rounds: int) -> dict:
    """Time both programs in turns; the least of each."""
    uploaded = upload_volume(volume, device)
    settings = SurfaceSettings(isovalue=isovalue)
    flying_edges = peers.flying_edges(volume, stored_isovalue(volume, isovalue), normals=True)
    flying_edges()
    _, counts = stages_of(uploaded, settings)
    stages, peer = [], []
    for _ in range(rounds):
        stages.append(stages_of(uploaded, settings)[0])
        start = time.perf_counter()
        flying_edges()
        peer.append(time.perf_counter() - start)
    best = min(stages, key=lambda found: sum(found.values()))
    total = sum(best.values())
    return counts | {
        "seconds": best | {"total": total, "flying edges": min(peer)},
        "ratio": min(peer) / total,
        "all_seconds": {"stages": stages, "flying edges": peer},
    }


def table(results: dict, device: str) -> str:
    names = [*STAGES, "total", "flying edges"]
    lines = [
        "| volume | quads | after | " + " | ".join(f"{name} ms" for name in names) + " | ratio |",
        "| --- |" + " ---: |" * (len(names) + 3),
    ]
    for name, found in results.items():
        cells = [name, str(found["quads"]), str(found["quads_after"])]
        cells += [f"{1e3 * found['seconds'][column]:.1f}" for column in names]
        lines.append("| " + " | ".join([*cells, f"{found['ratio']:.2f}"]) + " |")
    return "\n".join(lines) + f"\n\nDevice {device}. Goal for the ratio: 1."


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", help="name of the result files")
    options = parser.parse_args()
    warnings.filterwarnings("ignore")
    device = select_device(options.device, peers.THREADS)
    results = {}
    for case in CASES:
        volume = case.load()
        if volume is None:
            print(f"{case.name}: left out, {case.path} is absent")
            continue
        results[case.name] = measure(volume, case.isovalue, device, options.rounds)
        print(case.name, f"{results[case.name]['ratio']:.2f}", flush=True)
    text = table(results, device.name)
    print(text)
    if options.out:
        record(options.out, {"results": results}, "Simplified meshes beside flying edges", text)


if __name__ == "__main__":
    main()
