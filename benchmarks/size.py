"""Fewer quads beside VTK's quadric decimation of triangles: distances, shapes, topology, time.

    python benchmarks/size.py [--threads 2] [--rounds 1] [--only NAME] [--out NAME]

A quarter and a tenth of a tooth's quads, a quarter of a bone's and of a head's, and what bounds on the
distance leave (`--max-error`). vtkQuadricDecimation has the same surface in triangles, along the better
diagonals, and is asked for two triangles a quad. Distances are in voxels, to and from the fine mesh, by a
million samples of the larger one and all vertices. The papers' mean ratio is of triangles, so that both have
it.
Kernels are warm; CPU seconds are those of all threads together, the least of the rounds.

Goals for quads, to and from the fine mesh: a tooth's quarter .04 and .055 on average, at most .5 and 1, at
most 14 % irregular; its tenth at most 1 and 2.5; a bone's quarter .06 and .09; components and Euler
characteristic kept; within every bound. Adds a line to benchmarks/results/NAME.jsonl and writes NAME.md anew.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import vtk
from cases import CASES, ROOT
from history import record
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

from dmc_cli.contouring import connect_faces, extract_surface, kernel_modules as surface_kernels
from dmc_cli.field import upload_volume
from dmc_cli.measures import (
    NearestFaces,
    choose_diagonals,
    count_intersections,
    distance_kernels,
    kernel_modules,
    measure_distance,
    measure_quality,
    measure_topology,
    prove_proximity,
)
from dmc_cli.mesh import Mesh, irregular_percent, mesh_of_file
from dmc_cli.mesh_io import MeshFile
from dmc_cli.processing import Bound, decimate, kernel_modules as processing_kernels
from dmc_cli.runtime import load_kernels, select_device
from dmc_cli.settings import ReadSettings, SurfaceSettings
from dmc_cli.volume import Volume
from dmc_cli.volume_io import read_volume

SAMPLES = 1_000_000


@dataclass(frozen=True)
class Wanted:
    """A case: its name, the volume and isovalue, the share of quads, the bound in voxels."""

    name: str
    path: str
    isovalue: float
    share: float | None = None
    bound: float | None = None
    read: ReadSettings = field(default_factory=ReadSettings)


TOOTH = str(ROOT / "sample_data" / "nrrd" / "tooth.nrrd")
HEAD, BONE = CASES[2], CASES[3]
WANTED = (
    Wanted("tooth, a quarter", TOOTH, 500.0, share=0.25),
    Wanted("tooth, a tenth", TOOTH, 500.0, share=0.1),
    Wanted("bone, a quarter", BONE.path, BONE.isovalue, share=0.25, read=BONE.read),
    Wanted("head CT, a quarter", HEAD.path, HEAD.isovalue, share=0.25),
    Wanted("tooth, within 0.5", TOOTH, 500.0, bound=0.5),
    Wanted("bone, a quarter within 0.5", BONE.path, BONE.isovalue, share=0.25, bound=0.5, read=BONE.read),
)


def ours(surface, quads: int, bound: float | None) -> Callable[[], Mesh]:
    """The program's mesh of so many quads, within a bound in millimetres."""
    nearest = NearestFaces(surface.mesh)

    def find_beyond(mesh: Mesh) -> np.ndarray:
        beyond = prove_proximity(mesh, nearest, bound).beyond
        beyond[prove_proximity(surface.mesh, NearestFaces(mesh), bound).near_beyond] = True
        return beyond

    held = None if bound is None else Bound(bound, find_beyond)
    return lambda: decimate(surface.mesh, surface.placement, quads, bound=held).mesh


def quadrics(fine: Mesh, quads: int) -> Callable[[], Mesh]:
    """vtkQuadricDecimation of the same surface in triangles, to two a quad."""
    faces = fine.faces.numpy()
    second = choose_diagonals(fine).numpy().astype(bool)
    turned = np.where(second[:, None], np.roll(faces, -1, axis=1), faces)
    triangles = np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    data, places, polygons = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    places.SetData(numpy_to_vtk(fine.positions.numpy(), deep=True))
    ends = numpy_to_vtkIdTypeArray(np.arange(0, triangles.size + 1, 3, dtype=np.int64), deep=True)
    polygons.SetData(ends, numpy_to_vtkIdTypeArray(triangles.astype(np.int64).ravel(), deep=True))
    data.SetPoints(places)
    data.SetPolys(polygons)

    def run() -> Mesh:
        decimation = vtk.vtkQuadricDecimation()
        decimation.SetInputData(data)
        decimation.SetTargetReduction(1 - 2 * quads / len(triangles))
        decimation.Update()
        found = decimation.GetOutput()
        corners = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        points = vtk_to_numpy(found.GetPoints().GetData())
        rows = np.insert(corners, 3, -1, axis=1).astype(np.int32)
        return mesh_of_file(MeshFile(points=points, faces=rows), fine.device)

    return run


def measured(run: Callable[[], Mesh], fine: Mesh, voxel: float, rounds: int) -> dict[str, float | int | None]:
    """What a mesh is beside the fine one, and the least seconds."""
    seconds, work = [], []
    for _ in range(rounds):
        start, before = time.perf_counter(), time.process_time()
        mesh = run()
        seconds.append(time.perf_counter() - start)
        work.append(time.process_time() - before)
    distance = measure_distance(mesh, fine, SAMPLES / measure_quality(fine).area)
    quality, topology = measure_quality(mesh), measure_topology(mesh)
    is_quads = not mesh.triangle_count
    return {
        "faces": mesh.face_count,
        "mean_to": round(distance.to_other.mean / voxel, 4),
        "mean_from": round(distance.from_other.mean / voxel, 4),
        "max_to": round(distance.to_other.max / voxel, 3),
        "max_from": round(distance.from_other.max / voxel, 3),
        "irregular_percent": round(irregular_percent(mesh), 1) if is_quads else None,
        "shape": round(quality.shape_mean, 3) if is_quads else None,
        "mean_ratio": round(quality.mean_ratio_mean, 3),
        "components": topology.components,
        "euler": topology.euler_characteristic,
        "intersections": count_intersections(mesh),
        "seconds": round(min(seconds), 2),
        "cpu_seconds": round(min(work), 2),
    }


def row(name: str, program: str, found: dict) -> str:
    """A line of the table."""
    cells = [f"{found['mean_to']} / {found['mean_from']}", f"{found['max_to']} / {found['max_from']}"]
    cells += [str(found[key] or "") for key in ("irregular_percent", "shape", "mean_ratio")]
    cells += [f"{found['components']}, {found['euler']}", str(found["intersections"])]
    return f"| {name} | {program} | {found['faces']} | {' | '.join(cells)} | {found['cpu_seconds']} |"


def run_case(wanted: Wanted, volume: Volume, threads: int, rounds: int) -> dict[str, dict]:
    """What the program and VTK make of a case."""
    device = select_device("cpu", threads)
    settings = SurfaceSettings(isovalue=wanted.isovalue, border="closed")
    surface = connect_faces(extract_surface(upload_volume(volume, device), settings, volume.affine))
    voxel = float(np.linalg.norm(volume.affine[:3, :3], axis=0).min())
    fine = surface.mesh
    quads = 1 if wanted.share is None else round(wanted.share * fine.face_count)
    bound = None if wanted.bound is None else wanted.bound * voxel
    found = {"dmc": measured(ours(surface, quads, bound), fine, voxel, rounds)}
    found["vtk"] = measured(quadrics(fine, found["dmc"]["faces"]), fine, voxel, rounds)
    topology = measure_topology(fine)
    found["fine"] = {
        "quads": fine.face_count,
        "components": topology.components,
        "euler": topology.euler_characteristic,
    }
    return found


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--out", default="size")
    chosen = parser.parse_args()
    modules = [
        *surface_kernels(SurfaceSettings(isovalue=0.0), normals_too=False),
        *distance_kernels(proves=True),
    ]
    modules += [*kernel_modules(intersections=True), *processing_kernels(decimate=True)]
    load_kernels(select_device("cpu"), modules)
    head = (
        "| case | program | faces | mean to / from | largest to / from | irregular % | shape | mean ratio |"
    )
    lines = [f"{head} components, Euler | intersections | CPU s |", "| --- | --- |" + " ---: |" * 9]
    rows = {}
    for wanted in WANTED:
        case = next((case for case in CASES if case.path == wanted.path), None)
        volume = read_volume(wanted.path, wanted.read) if case is None else case.load()
        if volume is None or chosen.only not in wanted.name:
            continue
        found = rows[wanted.name] = run_case(wanted, volume, chosen.threads, chosen.rounds)
        fine = found["fine"]
        name = f"{wanted.name}; fine {fine['quads']} quads, {fine['components']}, {fine['euler']}"
        lines += [row(name, "dmc", found["dmc"]), row("", "VTK, triangles", found["vtk"])]
        print("\n".join(lines[-2:]), flush=True)
    title = f"Fewer quads beside vtkQuadricDecimation, {chosen.threads} threads; lengths in voxels"
    record(chosen.out, {"threads": chosen.threads, "cases": rows}, title, "\n".join(lines))


if __name__ == "__main__":
    main()
