"""Surfaces of labels beside VTK's surface nets: volume against the nodes, error of the normals, time.

    python benchmarks/labels.py [--threads 2] [--rounds 3] [--out NAME]

Balls have three random positions each, and known normals. The skull is a mask, the regions a map of twelve
labels that are made by the program; of a map the label with the largest error counts, of those with over 1000
nodes. VTK smooths with its defaults, 16 iterations. Kernels are warm; each time is the least of its rounds,
CPU seconds are those of all threads together. Goals: volumes of balls within 0.05, 0.1 and 0.5 %, normals
within 2.5 and 4.5 degrees, and 4 with slices of 3, maps within 0.1 %, and 3 seconds for the skull on two
threads. Adds a line to benchmarks/results/NAME.jsonl and writes NAME.md anew.
"""

import argparse
import time

import numpy as np
import vtk
from cases import SHARED
from history import record
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from dmc_cli.app import list_shells, make_label_mesh, patch_volumes
from dmc_cli.contouring import label_kernels
from dmc_cli.measures import finding_kernels
from dmc_cli.progress import SILENT, Stopwatch
from dmc_cli.runtime import load_kernels, select_device
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, find_labels
from dmc_cli.volume_io import read_volume

SKULL = SHARED / "nrrd_skull_mask" / "Skull.nrrd"

LEAST_NODES = 1000
"""Nodes of a label whose volume counts."""


def ball(radius: float, seed: int, spacing: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A ball in a random position as a mask [k, j, i], and its centre."""
    rng = np.random.default_rng(seed)
    count = [int(2 * (radius + 3) / step) + 3 for step in spacing]
    centre = np.array([(n // 2 + rng.random()) * step for n, step in zip(count, spacing, strict=True)])
    k, j, i = np.meshgrid(*[np.arange(n) for n in count[::-1]], indexing="ij")
    away = [n * step - c for n, step, c in zip((i, j, k), spacing, centre, strict=True)]
    return (sum(x * x for x in away) < radius**2).astype(np.uint8), centre


def regions() -> np.ndarray:
    """A map of twelve labels in smooth regions, [k, j, i]."""
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(1)
    fields = [gaussian_filter(rng.standard_normal((80, 90, 100)), 4) for _ in range(12)]
    return np.argmax(fields, axis=0).astype(np.uint8)


def normals_error(points: np.ndarray, faces: np.ndarray, centre: np.ndarray) -> float:
    """The RMS angle in degrees between quads' normals and those of a ball, whichever way they look."""
    p = points[faces].astype(float)
    normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    away = p.mean(axis=1) - centre
    lengths = np.linalg.norm(normal, axis=1) * np.linalg.norm(away, axis=1)
    cosine = np.abs(np.einsum("qi,qi->q", normal, away)) / np.maximum(lengths, 1e-30)
    return float(np.sqrt(np.mean(np.degrees(np.arccos(np.minimum(cosine, 1))) ** 2)))


def ours(volume: Volume, threads: int):
    """The program's mesh as (points, faces, {label: volume})."""
    device, found = select_device("cpu", threads), find_labels(volume)

    def run():
        mesh = make_label_mesh(volume, found.stored, volume.affine, device, Stopwatch(SILENT))
        volumes = [patch_volumes(s.points, s.faces).sum() for s in list_shells(mesh, len(found.labels))]
        return mesh.points, mesh.faces, dict(zip(found.labels.tolist(), volumes, strict=True))

    return run


def vtk_nets(volume: Volume, threads: int):
    """vtkSurfaceNets3D with quads on the STDThread backend, as `ours` returns it."""
    vtk.vtkSMPTools.SetBackend("STDThread")
    vtk.vtkSMPTools.Initialize(threads)
    padded = np.pad(volume.values, 1)  # closed at the border, as ours is
    image = vtk.vtkImageData()
    image.SetDimensions(*padded.shape[::-1])
    image.SetSpacing(*volume.spacing)
    image.SetOrigin(*(-step for step in volume.spacing))
    image.GetPointData().SetScalars(numpy_to_vtk(padded.ravel(), deep=True))
    labels = find_labels(volume).labels.tolist()

    def run():
        nets = vtk.vtkSurfaceNets3D()
        nets.SetInputData(image)
        nets.GenerateLabels(len(labels), labels[0], labels[-1])
        nets.SetOutputMeshTypeToQuads()
        nets.Update()
        found = nets.GetOutput()
        points = vtk_to_numpy(found.GetPoints().GetData())
        faces = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 4).astype(np.int32)
        sides = vtk_to_numpy(found.GetCellData().GetArray("BoundaryLabels"))
        return points, faces, {n: side_volume(points, faces, sides, n) for n in labels}

    return run


def side_volume(points: np.ndarray, faces: np.ndarray, sides: np.ndarray, label: int) -> float:
    """The volume of a label whose faces look from the first side to the second, or all the other way."""
    parts = patch_volumes(points, faces)
    return abs(float(parts[sides[:, 0] == label].sum() - parts[sides[:, 1] == label].sum()))


def measured(make, volumes, centres, threads: int, rounds: int) -> dict[str, float]:
    """The largest error of a volume in percent, the mean RMS error of normals, the least seconds."""
    worst, angles, seconds, work = 0.0, [], [], []
    for volume, centre in zip(volumes, centres, strict=True):
        run, found = make(volume, threads), find_labels(volume)
        for _ in range(rounds):
            start, before = time.perf_counter(), time.process_time()
            points, faces, enclosed = run()
            seconds.append(time.perf_counter() - start)
            work.append(time.process_time() - before)
        node = float(np.prod(volume.spacing))
        for label, count in zip(found.labels.tolist(), found.counts.tolist(), strict=True):
            if count > LEAST_NODES or len(found.labels) == 1:
                worst = max(worst, abs(enclosed[label] / (count * node) - 1) * 100)
        if centre is not None:
            angles.append(normals_error(points, faces, centre))
    return {
        "volume_percent": round(worst, 4),
        "normals_degrees": round(float(np.mean(angles)), 2) if angles else None,
        "seconds": round(min(seconds), 3),
        "cpu_seconds": round(min(work), 3),
        "quads": len(faces),
    }


def cases() -> dict[str, tuple[list[Volume], list[np.ndarray | None]]]:
    """The volumes of each case, with the balls' centres."""
    found: dict[str, tuple[list[Volume], list[np.ndarray | None]]] = {}
    for name, radius, spacing in (
        ("ball 20", 20, (1.0, 1.0, 1.0)),
        ("ball 8", 8, (1.0, 1.0, 1.0)),
        ("ball 3", 3, (1.0, 1.0, 1.0)),
        ("ball 20, 1x1x3", 20, (1.0, 1.0, 3.0)),
    ):
        made = [ball(radius, seed, spacing) for seed in range(3)]
        affine = np.diag([*spacing, 1.0])
        found[name] = (
            [Volume(values=labels, affine=affine, space="none") for labels, _ in made],
            [centre for _, centre in made],
        )
    found["regions, 12 labels"] = ([Volume(values=regions(), affine=np.eye(4), space="none")], [None])
    if SKULL.exists():
        skull = read_volume(str(SKULL), ReadSettings()).values
        found["skull mask"] = ([Volume(values=skull, affine=np.eye(4), space="none")], [None])
    return found


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--out", default="labels")
    chosen = parser.parse_args()
    load_kernels(select_device("cpu"), [*label_kernels(), *finding_kernels()])
    rows, lines = (
        {},
        ["| case | quads | volume % | normals ° | s | CPU s | VTK: volume % | normals ° | s | CPU s |"],
    )
    lines.append("| --- |" + " ---: |" * 9)
    for name, (volumes, centres) in cases().items():
        found = [measured(make, volumes, centres, chosen.threads, chosen.rounds) for make in (ours, vtk_nets)]
        rows[name] = dict(zip(("dmc", "vtk"), found, strict=True))
        cells = [
            " | ".join(
                str(one[key] if one[key] is not None else "")
                for key in ("volume_percent", "normals_degrees", "seconds", "cpu_seconds")
            )
            for one in found
        ]
        lines.append(f"| {name} | {found[0]['quads']} | {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    title = f"Surfaces of labels beside vtkSurfaceNets3D, {chosen.threads} threads"
    record(chosen.out, {"threads": chosen.threads, "cases": rows}, title, "\n".join(lines))


if __name__ == "__main__":
    main()
