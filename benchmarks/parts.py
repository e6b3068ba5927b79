"""The part that one wants, of 512x512x500 nodes, beside SciPy: components, morphology, filters.

    python benchmarks/parts.py [--threads 2] [--rounds 3] [--fast] [--out NAME]

The volume is a CT of a head with what it lies on, repeated along z as often as it takes; without the real
one, noise. Ours is the whole stage of a conversion, from the values to those that are contoured, with warm
kernels, the least of its rounds; SciPy does the same once, on one thread, as its documentation has it.
`--fast` leaves it out. The goal is 2 seconds for each, on two threads. Adds a line to
benchmarks/results/NAME.jsonl and writes NAME.md anew.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from cases import CASES
from history import record
from scipy import ndimage

from dmc_cli.app import load_needed_kernels, prepare
from dmc_cli.field import upload_volume
from dmc_cli.runtime import select_device
from dmc_cli.settings import ConvertSettings, OutputSettings, PartSettings, ReadSettings, SurfaceSettings
from dmc_cli.volume import Suggestions, Volume
from dmc_cli.volume_io import read_volume

NODES = (500, 512, 512)
LEVEL, TISSUE = 300.0, -300.0

PARTS = {
    "--keep largest": PartSettings(keep="largest"),
    "--min-volume 1000": PartSettings(min_volume=1000.0),
    "--fill-cavities": PartSettings(fill_cavities="all"),
    "--cut-table": PartSettings(cut_table=True),
    "--open-gaps 2": PartSettings(open_gaps=2.0),
    "--close-gaps 2": PartSettings(close_gaps=2.0),
    "--resample 2": PartSettings(resample="2"),
    "--smooth-volume 1": PartSettings(smooth_volume=1.0),
}


def volume() -> Volume:
    """Return the volume: the head, as it is and turned over in turns, or balls in noise."""
    head = next(case for case in CASES if case.name.startswith("head")).load()
    if head is None:
        head = read_volume("synth:noise:512", ReadSettings())
        head = replace(head, values=(1000 * head.values).astype(np.int16), formula=None)
    values = head.values
    turns = [values if n % 2 == 0 else values[::-1] for n in range(-(-NODES[0] // len(values)))]
    return replace(head, values=np.ascontiguousarray(np.concatenate(turns)[: NODES[0]]), slice_positions=None)


def ball(radius: float) -> np.ndarray:
    """Return the nodes within a radius."""
    reach = int(radius)
    steps = np.mgrid[-reach : reach + 1, -reach : reach + 1, -reach : reach + 1]
    return (steps**2).sum(axis=0) <= radius**2


def sizes(inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the component of each node, and the nodes of each, the background as the first."""
    labels, _ = ndimage.label(inside)
    return labels, np.bincount(labels.ravel())


def largest(values: np.ndarray, level: float) -> np.ndarray:
    """Return the values without components but the largest, as the others here do what they are named for."""
    labels, count = sizes(values >= level)
    return np.where((labels > 0) & (labels != count[1:].argmax() + 1), 2 * level - values, values)


def large(values: np.ndarray, level: float) -> np.ndarray:
    labels, count = sizes(values >= level)
    is_small = count < 1000
    is_small[0] = False
    return np.where(is_small[labels], 2 * level - values, values)


def filled(values: np.ndarray, level: float) -> np.ndarray:
    inside = values >= level
    return np.where(ndimage.binary_fill_holes(inside) & ~inside, 2 * level - values, values)


def opened(values: np.ndarray, level: float) -> np.ndarray:
    inside = values >= level
    return np.where(inside & ~ndimage.binary_opening(inside, ball(1.0)), 2 * level - values, values)


def closed(values: np.ndarray, level: float) -> np.ndarray:
    inside = values >= level
    return np.where(~inside & ndimage.binary_closing(inside, ball(1.0)), 2 * level - values, values)


def without_table(values: np.ndarray, _: float) -> np.ndarray:
    """Return the values without wide components beside what is thick, thick by distances."""
    tissue = values >= TISSUE
    core = ndimage.distance_transform_edt(tissue) > 8
    thick = ndimage.distance_transform_edt(~core) <= 8
    labels, count = sizes(thick & tissue)
    is_body = count >= 0.02 * count[1:].max()
    is_body[0] = False
    rest, _ = sizes(tissue & ~is_body[labels])
    boxes = ndimage.find_objects(rest)
    wide = [
        number
        for number, (z, y, x) in enumerate(boxes, 1)
        if z.stop - z.start >= len(values) / 2 and max(y.stop - y.start, x.stop - x.start) >= 128
    ]
    return np.where(np.isin(rest, wide), 2 * TISSUE - values, values)


def coarse(values: np.ndarray, _: float) -> np.ndarray:
    smooth = ndimage.gaussian_filter(values.astype(np.float32), 1.0)
    return ndimage.zoom(smooth, 0.5, order=1, mode="grid-constant", grid_mode=True)


def smooth(values: np.ndarray, _: float) -> np.ndarray:
    return ndimage.gaussian_filter(values.astype(np.float32), 1.0)


PEERS: dict[str, Callable[[np.ndarray, float], np.ndarray]] = {
    "--keep largest": largest,
    "--min-volume 1000": large,
    "--fill-cavities": filled,
    "--cut-table": without_table,
    "--open-gaps 2": opened,
    "--close-gaps 2": closed,
    "--resample 2": coarse,
    "--smooth-volume 1": smooth,
}


def timed(run: Callable[[], object], rounds: int) -> tuple[float, float]:
    """Return the least seconds of some rounds, and the least that all threads took together."""
    walls, works = [], []
    for _ in range(rounds):
        start, before = time.perf_counter(), time.process_time()
        run()
        walls.append(time.perf_counter() - start)
        works.append(time.process_time() - before)
    return min(walls), min(works)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--fast", action="store_true")
    parser.add_argument("--out", default="parts")
    chosen = parser.parse_args()
    device, source = select_device("cpu", chosen.threads), volume()
    on_device, found = upload_volume(source, device), Suggestions(source)
    stored = source.values
    cut = (LEVEL - source.intercept) / source.slope
    rows, lines = {}, ["| option | s | CPU s | SciPy, s | ratio |", "| --- |" + " ---: |" * 4]
    for name, part in PARTS.items():
        settings = ConvertSettings(
            input="volume",
            surface=SurfaceSettings(isovalue=LEVEL),
            output=OutputSettings(path="-", output_format="ply"),
            part=part,
            threads=chosen.threads,
        )
        load_needed_kernels([settings])
        wall, work = timed(lambda s=settings: prepare(s, on_device, lambda _: found), chosen.rounds)
        row = {"seconds": round(wall, 3), "cpu_seconds": round(work, 3)}
        cells = [f"{wall:.2f}", f"{work:.2f}", "", ""]
        if not chosen.fast:
            peer, _ = timed(lambda p=PEERS[name]: p(stored, cut), 1)
            row["scipy_seconds"] = round(peer, 3)
            cells[2:] = [f"{peer:.1f}", f"{peer / wall:.0f}"]
        rows[name] = row
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    title = f"Parts of 512x512x500 nodes beside SciPy, {chosen.threads} threads"
    record(chosen.out, {"threads": chosen.threads, "parts": rows}, title, "\n".join(lines))


if __name__ == "__main__":
    main()
