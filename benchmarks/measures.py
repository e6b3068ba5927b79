"""Measures of a mesh: self-intersections, and distances of vertices beside VTK's Hausdorff distance.

    python benchmarks/measures.py [--device cpu] [--rounds 3] [--fast] [--out NAME]

On two threads with kernels warm; each figure is the least of its rounds, which are interleaved. Of the two
meshes between which the distance is taken, one is the other, moved by a third of the spacing; both ways, from
vertices to faces. Self-intersections have no peer here: Open3D's time grows with the square of the faces (13
seconds for 25,600 quads), libraries that do it well are under the GPL. The goals are 5 s for a million quads,
and a ratio of 1. Adds a line to benchmarks/results/NAME.jsonl and writes NAME.md anew.
"""

import argparse
import time
import warnings

import numpy as np
import peers
import vtk
import warp as wp
from cases import CASES
from history import record
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

from dmc_cli.contouring import extract_surface
from dmc_cli.field import upload_volume
from dmc_cli.measures import NearestFaces, count_intersections, measure_elements, measure_quality
from dmc_cli.mesh import Mesh
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings

COLUMNS = ("shape", "intersections", "distance", "VTK distance")


def moved(mesh: Mesh, by: float) -> Mesh:
    """The mesh, moved along the diagonal."""
    points = mesh.positions.numpy() + np.float32(by)
    return Mesh(wp.array(points, dtype=wp.vec3f, device=mesh.device.name), mesh.faces, mesh.device)


def vertex_distance(mesh: Mesh, other: Mesh) -> float:
    """The largest distance of a vertex of one mesh from the faces of the other, both ways."""
    ends = []
    for one, two in ((mesh, other), (other, mesh)):
        points = wp.array(one.positions.numpy().astype(float), dtype=wp.vec3d, device=mesh.device.name)
        ends.append(NearestFaces(two).distances(points).max())
    return float(max(ends))


def as_polydata(mesh: Mesh) -> vtk.vtkPolyData:
    """The mesh as VTK has it."""
    faces = mesh.faces.numpy()
    rows = np.column_stack([np.full(len(faces), 4), faces]).astype(np.int64).ravel()
    made, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetData(numpy_to_vtk(mesh.positions.numpy(), deep=True))
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(rows, deep=True))
    made.SetPoints(points)
    made.SetPolys(cells)
    return made


def vtk_distance(mesh: Mesh, other: Mesh) -> float:
    """The same by vtkHausdorffDistancePointSetFilter, which uses one thread."""
    judge = vtk.vtkHausdorffDistancePointSetFilter()
    judge.SetTargetDistanceMethodToPointToCell()
    judge.SetInputData(0, as_polydata(mesh))
    judge.SetInputData(1, as_polydata(other))
    judge.Update()
    return judge.GetHausdorffDistance()


def measure(mesh: Mesh, spacing: float, rounds: int) -> dict:
    """Time everything in turns; the least of each."""
    other = moved(mesh, spacing / 3)
    ways = {
        "shape": lambda: (measure_quality(mesh), measure_elements(mesh)),
        "intersections": lambda: count_intersections(mesh),
        "distance": lambda: vertex_distance(mesh, other),
        "VTK distance": lambda: vtk_distance(mesh, other),
    }
    found = {name: way() for name, way in ways.items()}
    times: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, way in ways.items():
            start = time.perf_counter()
            way()
            wp.synchronize()
            times[name].append(time.perf_counter() - start)
    seconds = {name: min(taken) for name, taken in times.items()}
    return {
        "quads": mesh.face_count,
        "intersections": found["intersections"],
        "distances": [found["distance"], found["VTK distance"]],
        "seconds": seconds,
        "per_million": 1e6 * seconds["intersections"] / mesh.face_count,
        "ratio": seconds["VTK distance"] / seconds["distance"],
        "all_seconds": times,
    }


def table(results: dict, device: str) -> str:
    lines = [
        "| volume | quads | pairs | "
        + " | ".join(f"{name} s" for name in COLUMNS)
        + " | s a million | ratio |",
        "| --- |" + " ---: |" * (len(COLUMNS) + 4),
    ]
    for name, found in results.items():
        cells = [name, str(found["quads"]), str(found["intersections"])]
        cells += [f"{found['seconds'][column]:.2f}" for column in COLUMNS]
        cells += [f"{found['per_million']:.2f}", f"{found['ratio']:.2f}"]
        lines.append("| " + " | ".join(cells) + " |")
    goals = "intersections of a million quads in 5 s; a ratio, of distances, of 1"
    return "\n".join(lines) + f"\n\nDevice {device}. Goals: {goals}."


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--fast", action="store_true", help="only the first volume")
    parser.add_argument("--out", help="name of the result files")
    options = parser.parse_args()
    warnings.filterwarnings("ignore")
    device = select_device(options.device, peers.THREADS)
    results = {}
    for case in CASES[: 1 if options.fast else None]:
        volume = case.load()
        if volume is None:
            print(f"{case.name}: left out, {case.path} is absent")
            continue
        surface = extract_surface(upload_volume(volume, device), SurfaceSettings(isovalue=case.isovalue))
        results[case.name] = measure(surface.mesh, min(volume.spacing), options.rounds)
        print(case.name, f"{results[case.name]['per_million']:.2f} s a million", flush=True)
    text = table(results, device.name)
    print(text)
    if options.out:
        record(options.out, {"results": results}, "Measures of a mesh", text)


if __name__ == "__main__":
    main()
