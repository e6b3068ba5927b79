"""No two faces intersect on scans, whatever is done to their quads."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.app.mesh_stages import Stages, decimate_stages, relax_stages, repair_stages, simplify_stages
from dmc_cli.contouring import connect_faces, extract_surface
from dmc_cli.field import upload_volume
from dmc_cli.measures import count_intersections
from dmc_cli.progress import SILENT, Stopwatch
from dmc_cli.runtime import select_device
from dmc_cli.settings import MeshSettings, ReadSettings, SurfaceSettings
from dmc_cli.volume import Volume
from dmc_cli.volume_io import read_volume

VOLUMES = {
    "tooth": ("nrrd_tooth/tooth.nhdr", 500.0, {}),
    "bone": (
        "raw_microct_bone/trabecular_crop_128x128x128_uint8.raw",
        85.0,
        {"shape": (128, 128, 128), "dtype": "uint8"},
    ),
    "skull": ("nrrd_skull_mask/Skull.nrrd", 0.5, {}),
    "head": ("dicom_vhf_head.zip", 300.0, {}),
}

CROPS = {"bone": np.s_[:40, :40, :40], "skull": np.s_[20:68, 50:98, 40:88]}
"""Where a part of a volume has quads that some stage makes intersect."""

SIMPLIFICATIONS = [
    {"simplify": "none"},
    {"simplify": "3x3y"},
    {"simplify": "3333"},
    {"simplify": "all"},
    {"simplify": "all", "remesh": 3},
]

PARTS_OF_ALL = {"3x3y", "3333"}
"""Simplifications that "all" does one after the other."""


def read(folder, name) -> Volume:
    path, _, options = VOLUMES[name]
    return read_volume(str(folder / path), ReadSettings(**options))


def results(volume: Volume, isovalue: float, simplification: dict) -> Iterator[tuple[str, Stages]]:
    """Yield the meshes of all combinations with one simplification, before the repair, and how they came."""
    device, watch = select_device("cpu", 2), Stopwatch(SILENT)
    surface = connect_faces(
        extract_surface(upload_volume(volume, device), SurfaceSettings(isovalue=isovalue), volume.affine)
    )
    stages = Stages(surface.mesh, surface.placement)
    if simplification["simplify"] != "none":
        simplify_stages(stages, MeshSettings(**simplification), watch)
    for size in (None, "30%"):
        if size is not None:
            decimate_stages(stages, MeshSettings(quads=size), np.eye(3), watch, is_measured=False)
        yield f"quads {size}", Stages(stages.mesh, stages.placement)
        smooth = Stages(stages.mesh, stages.placement)
        relax_stages(smooth, 4, watch)
        yield f"quads {size}, relaxed", smooth


def repaired(stages: Stages) -> dict[str, int]:
    repair_stages(stages, Stopwatch(SILENT))
    assert count_intersections(stages.mesh) == stages.repair["pairs_after"]
    return stages.repair


@pytest.mark.real
@pytest.mark.parametrize(
    "simplification",
    [
        pytest.param(
            given, marks=pytest.mark.slow if given["simplify"] in PARTS_OF_ALL else (), id=str(given)
        )
        for given in SIMPLIFICATIONS
    ],
)
@pytest.mark.parametrize("name", CROPS)
def test_no_two_faces_of_a_part_intersect(shared_data, name, simplification):
    volume = read(shared_data, name)
    part = replace(volume, values=np.ascontiguousarray(volume.values[CROPS[name]]))
    for made, stages in results(part, VOLUMES[name][1], simplification):
        assert repaired(stages)["pairs_after"] == 0, made


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.real
@pytest.mark.parametrize("simplification", SIMPLIFICATIONS, ids=str)
@pytest.mark.parametrize("name", VOLUMES)
def test_no_two_faces_of_a_scan_intersect(shared_data, name, simplification):
    for made, stages in results(read(shared_data, name), VOLUMES[name][1], simplification):
        assert repaired(stages)["pairs_after"] == 0, made
