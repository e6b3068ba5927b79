"""`--max-error` is kept on five volumes: nothing is further away, both ways, by dense samples."""

import numpy as np
import pytest

from dmc_cli.app import convert
from dmc_cli.measures import measure_distance, measure_topology
from dmc_cli.mesh import mesh_of_file
from dmc_cli.runtime import Device
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, ReadSettings, SurfaceSettings
from tests.conftest import ROOT

SAMPLES = ROOT / "sample_data"
BONE = ReadSettings(shape=(128, 128, 128), dtype="uint8")

CASES = {
    "tooth": ("nrrd/tooth.nrrd", 500.0, ReadSettings(), 0.5, None),
    "bone": ("raw/trabecular_crop_128x128x128_uint8.raw", 85.0, BONE, 0.6, "25%"),
    "head CT": ("dicom/head_ct", 300.0, ReadSettings(), 0.7, "25%"),
    "fistula": ("nrrd/fistula_mra.nrrd", 500.0, ReadSettings(), 0.5, None),
    "genus two": ("synth:genus_two:64", 0.0, ReadSettings(), 0.3, None),
}
"""Volume, isovalue, how it is read, the bound in voxels, and what number is asked for beside it."""


def converted(path, isovalue, read, tmp_path, mesh):
    return convert(
        ConvertSettings(
            input=path,
            read=read,
            surface=SurfaceSettings(isovalue=isovalue, border="closed"),
            mesh=mesh,
            output=OutputSettings(path=str(tmp_path / "mesh.ply"), force=True, normals=False),
            threads=2,
        )
    )


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", CASES)
def test_every_sample_is_within_the_bound_both_ways(name, tmp_path):
    path, isovalue, read, voxels, quads = CASES[name]
    path = path if path.startswith("synth:") else str(SAMPLES / path)
    fine = converted(path, isovalue, read, tmp_path, MeshSettings())
    error = voxels * min(fine.report["input"]["spacing_mm"])
    wanted = MeshSettings(max_error=error, quads=quads, relax=2)
    coarse = converted(path, isovalue, read, tmp_path, wanted)
    device = Device("cpu", 2)
    one, other = (mesh_of_file(result.mesh, device) for result in (coarse, fine))
    assert one.face_count <= 0.5 * other.face_count
    found = measure_distance(one, other, 40.0 / min(fine.report["input"]["spacing_mm"]) ** 2)
    assert found.to_other.samples > 10 * other.face_count
    assert max(found.to_other.max, found.from_other.max) <= error
    assert found.both.max == pytest.approx(
        max(coarse.report["size"][way]["max"] for way in ("to_before", "from_before")), rel=0.2
    )
    before, after = measure_topology(other), measure_topology(one)
    assert (after.components, after.euler_characteristic) == (before.components, before.euler_characteristic)
    assert np.isfinite(coarse.mesh.points).all()
