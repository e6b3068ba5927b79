"""Methods of contouring beside VTK, scikit-image and Warp, from values in memory to a mesh in memory.

    python benchmarks/methods.py [--device cpu] [--rounds 5] [--fast] [--out NAME]

On two threads, kernels warm, without normals; each figure is the least of its rounds, in which all methods
and vtkFlyingEdges3D take turns, twice in a row, so that memory is as the method itself leaves it. Peers that
take seconds have one turn. Then the head CT is cut at sixteen isovalues, in one run of `dmc convert` and in
sixteen (`isovalues.py`), and pairs of intersecting quads are counted. What is asked for of each is in the
table of goals. Adds a line to benchmarks/results/NAME.jsonl and writes NAME.md anew.
"""

import argparse
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import peers
from cases import CASES, Case
from history import record
from isovalues import one_and_sixteen_runs

from dmc_cli.contouring import extract_surface, kernel_modules
from dmc_cli.field import upload_volume
from dmc_cli.measures import count_intersections
from dmc_cli.methods import METHODS
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume

VTK, SCIKIT, NETS = "vtkFlyingEdges3D", "scikit-image", "IsoSurfaceNets"

SLOW = (SCIKIT, NETS)
"""Peers that take seconds."""

HARD = ("iWP 512", "head CT, 300 HU")
"""Cases in which marching cubes has a higher goal."""

Times = dict[str, float]
"""Milliseconds of each method and peer."""


@dataclass(frozen=True)
class Goal:
    """How many times as fast as another one a method is to be, at least."""

    method: str
    other: str
    ratio: Callable[[str], float]  # by the name of the case


GOALS = (
    Goal("mc", VTK, lambda case: 2.5 if case in HARD else 1.5),
    Goal("tmc", "mc", lambda case: 0.75),
    Goal("nets", NETS, lambda case: 20.0),
    Goal("dc", VTK, lambda case: 1.0),
    Goal("macet", SCIKIT, lambda case: 3.0),
)

ONE_RUN = 3.0
"""How many times as long sixteen runs take as one at all isovalues, at least."""

MOST_SECONDS = 5.0
"""In which the intersections of a million quads are counted."""


def runs_of(case: Case, volume: Volume, device: Device) -> dict[str, Callable[[], object]]:
    """What takes turns on a case, by name: our methods, then the peers."""
    level = (case.isovalue - volume.intercept) / volume.slope
    uploaded = upload_volume(volume, device)

    def ours(method: str) -> Callable[[], object]:
        settings = SurfaceSettings(isovalue=case.isovalue, method=method)
        return lambda: extract_surface(uploaded, settings)

    return {method: ours(method) for method in METHODS} | {
        VTK: peers.flying_edges(volume, level),
        SCIKIT: peers.scikit_image(volume, level),
        NETS: peers.surface_nets(volume, level),
    }


def milliseconds(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return 1e3 * (time.perf_counter() - start)


def least_times(runs: dict[str, Callable[[], object]], rounds: int) -> Times:
    """The least of rounds in which all take turns."""
    least = {name: milliseconds(run) for name, run in runs.items() if name in SLOW}
    for _ in range(rounds):
        for name, run in runs.items():
            if name not in SLOW:
                least[name] = min(least.get(name, float("inf")), milliseconds(run), milliseconds(run))
    return least


def seconds_a_million(case: Case, volume: Volume, device: Device, rounds: int) -> float:
    """Seconds that it takes to count the intersections of a million quads, one round being to warm up."""
    mesh = extract_surface(upload_volume(volume, device), SurfaceSettings(isovalue=case.isovalue)).mesh
    found = [milliseconds(lambda: count_intersections(mesh)) for _ in range(rounds + 1)]
    return min(found[1:]) * 1e3 / mesh.face_count


def table_of_times(found: dict[str, Times]) -> str:
    """A table in Markdown: a row a method or peer, a column a case, the ratio to vtkFlyingEdges3D behind."""
    lines = [f"| ms (times as fast as {VTK}) | " + " | ".join(found) + " |"]
    lines.append("| --- |" + " ---: |" * len(found))
    for name in next(iter(found.values())):
        cells = [f"{times[name]:.1f} ({times[VTK] / times[name]:.2f})" for times in found.values()]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def judged(found: dict[str, Times]) -> Iterator[tuple[str, str, float, float]]:
    """Yield what is asked for, the case, the ratio that was reached, and the goal."""
    for goal in GOALS:
        for case, times in found.items():
            if goal.method in times:
                reached = times[goal.other] / times[goal.method]
                yield f"{goal.method} beside {goal.other}", case, reached, goal.ratio(case)


def table_of_goals(rows: list[tuple[str, str, float, float]]) -> str:
    """A table in Markdown of what `judged` yields."""
    lines = ["| times as fast | volume | reached | goal | |", "| --- | --- | ---: | ---: | --- |"]
    for name, case, reached, goal in rows:
        verdict = "met" if reached >= goal else "**missed**"
        lines.append(f"| {name} | {case} | {reached:.2f} | {goal:g} | {verdict} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--fast", action="store_true", help="the methods on the small cases only")
    parser.add_argument("--out", help="name of the files in benchmarks/results")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", DeprecationWarning)
    device = select_device(chosen.device, peers.THREADS)
    for method in METHODS:
        load_kernels(device, kernel_modules(SurfaceSettings(isovalue=0.0, method=method), normals_too=False))
    found: dict[str, Times] = {}
    others: list[tuple[str, str, float, float]] = []
    for case in CASES:
        volume = None if chosen.fast and case.name in HARD else case.load()
        if volume is None:
            print(f"{case.name}: left out", flush=True)
            continue
        found[case.name] = least_times(runs_of(case, volume, device), chosen.rounds)
        print(case.name, {name: round(ms, 1) for name, ms in found[case.name].items()}, flush=True)
        if case.name == "iWP 256":
            took = seconds_a_million(case, volume, device, 2)
            print(f"intersections of a million quads: {took:.2f} s", flush=True)
            others.append(
                (
                    f"intersections of a million quads in {MOST_SECONDS:g} s",
                    case.name,
                    MOST_SECONDS / took,
                    1.0,
                )
            )
        if case.name.startswith("head") and device.is_cpu:
            together, each = one_and_sixteen_runs(volume, peers.THREADS, 1)
            print(f"sixteen isovalues: {together:.1f} s in one run, {each:.1f} s in sixteen", flush=True)
            others.append(
                ("sixteen isovalues in one run beside sixteen runs", case.name, each / together, ONE_RUN)
            )
    rows = [*judged(found), *others]
    table = f"{table_of_goals(rows)}\n\n{table_of_times(found)}"
    print(table)
    if chosen.out:
        found_goals = [dict(zip(("what", "volume", "reached", "goal"), row, strict=True)) for row in rows]
        record(
            chosen.out,
            {"milliseconds": found, "goals": found_goals},
            "Methods of contouring beside other programs",
            table,
        )


if __name__ == "__main__":
    main()
