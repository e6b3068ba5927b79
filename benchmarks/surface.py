"""Volume in memory to vertices and quads, beside the peers, in one run on two threads with kernels warm.

    python benchmarks/surface.py [--device cpu] [--threads 2] [--rounds 7] [--fast] [--out NAME]

Rounds are interleaved, so that a machine that slows down slows all down, and short runs are repeated for
`LEAST_SECONDS`; each figure is the least of its rounds. Adds a line to benchmarks/results/NAME.jsonl and
writes NAME.md anew.
"""

import argparse
import time
import warnings

import peers
import warp as wp
from cases import CASES
from history import record

from dmc_cli.contouring import extract_surface
from dmc_cli.field import stored_isovalue, upload_volume
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings

GOALS = {"flying edges": 2.0, "scikit-image": 12.0, "surface nets": 8.0}
SLOW = ("scikit-image", "surface nets")
LEAST_SECONDS = 2.0


def seconds(run) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def measure(volume, isovalue: float, device, rounds: int, fast: bool) -> dict:
    level = stored_isovalue(volume, isovalue)
    uploaded = upload_volume(volume, device)
    settings = SurfaceSettings(isovalue=isovalue)
    counts = {}

    def dmc() -> None:
        surface = extract_surface(uploaded, settings)
        wp.synchronize()
        counts["quads"] = surface.mesh.face_count

    runs = {"dmc": dmc, "flying edges": peers.flying_edges(volume, level)}
    if not fast:
        runs |= {
            "scikit-image": peers.scikit_image(volume, level),
            "surface nets": peers.surface_nets(volume, level),
        }
    for name, run in runs.items():
        if name not in SLOW:
            run()
    times = {name: [] for name in runs}
    began = time.perf_counter()
    turn = 0
    while turn < rounds or time.perf_counter() - began < LEAST_SECONDS:
        for name, run in runs.items():
            if turn == 0 or name not in SLOW:
                times[name].append(seconds(run))
        turn += 1
    least = {name: min(values) for name, values in times.items()}
    ratios = {name: least[name] / least["dmc"] for name in runs if name != "dmc"}
    return {"quads": counts["quads"], "seconds": least, "ratios": ratios, "all_seconds": times}


def table(results: dict, device: str) -> str:
    lines = [
        "| volume | quads | dmc ms | " + " | ".join(f"{name} ms | ratio" for name in GOALS) + " |",
        "| --- | ---: | ---: |" + " ---: |" * (2 * len(GOALS)),
    ]
    for name, found in results.items():
        cells = [name, str(found["quads"]), f"{1e3 * found['seconds']['dmc']:.1f}"]
        for peer in GOALS:
            if peer in found["seconds"]:
                cells += [f"{1e3 * found['seconds'][peer]:.1f}", f"{found['ratios'][peer]:.1f}"]
            else:
                cells += ["", ""]
        lines.append("| " + " | ".join(cells) + " |")
    goals = ", ".join(f"{name} {goal:g}" for name, goal in GOALS.items())
    lines.append(f"\nDevice {device}. Goals for the ratios: {goals}.")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description="Time surface extraction beside its peers.")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=peers.THREADS)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--fast", action="store_true", help="only the fastest peer")
    parser.add_argument("--out", help="name of the result files")
    options = parser.parse_args()
    warnings.filterwarnings("ignore")
    peers.THREADS = options.threads
    device = select_device(options.device, options.threads)
    results = {}
    for case in CASES:
        volume = case.load()
        if volume is None:
            print(f"{case.name}: left out, {case.path} is absent")
            continue
        results[case.name] = measure(volume, case.isovalue, device, options.rounds, options.fast)
        print(case.name, {k: f"{v:.2f}" for k, v in results[case.name]["ratios"].items()}, flush=True)
    text = table(results, f"{device.name}, {options.threads} thread(s)")
    print(text)
    if options.out:
        record(options.out, {"results": results}, "Surface extraction beside its peers", text)


if __name__ == "__main__":
    main()
