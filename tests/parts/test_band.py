"""The surface of a band: nodes between two values are inside, crossings where the values have them."""

import json

import numpy as np
import pytest

from dmc_cli.contouring import extract_surface
from dmc_cli.field import upload_volume
from dmc_cli.mesh_io import read_mesh
from dmc_cli.parts import band_bytes, band_volume
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume


def volume_of(values, **given):
    return Volume(values=np.asarray(values), affine=np.eye(4), space="none", **given)


def physical(volume):
    return volume.slope * volume.values.astype(np.float64) + volume.intercept


@pytest.mark.parametrize(
    "dtype", ["uint8", "int8", "int16", "uint16", "int32", "uint32", "float32", "float64"]
)
@pytest.mark.parametrize("ends", [(20, 60), (20.25, 60), (-9, 31.5), (40, 40)])
@pytest.mark.parametrize("slope", [1.0, -1.0])
def test_what_lies_between_is_inside(dtype, ends, slope):
    values = np.random.default_rng(0).integers(0, 100, (6, 7, 40)).astype(dtype)
    source = volume_of(values, slope=slope, intercept=0.0 if slope > 0 else 99.0)
    found = band_volume(source, *ends)
    assert found.values.nbytes == band_bytes(source, *ends)
    between = (physical(source) >= ends[0]) & (physical(source) <= ends[1])
    np.testing.assert_array_equal(found.values >= 0, between)


def test_nodes_without_data_stay_so():
    values = np.random.default_rng(0).integers(0, 100, (4, 5, 6)).astype(np.int16)
    found = band_volume(volume_of(values, padding=(90, 99)), 20, 60)
    low, high = found.padding
    np.testing.assert_array_equal((found.values >= low) & (found.values <= high), values >= 90)
    floats = values.astype(np.float32)
    floats[floats > 95] = np.inf
    found = band_volume(volume_of(floats, padding=(90, 95)), 20, 60)
    np.testing.assert_array_equal(np.isnan(found.values), values >= 90)


def test_both_sheets_of_a_smooth_field_are_where_the_values_have_them():
    # distance from the middle: between 6 and 11 lies a shell
    grid = np.indices((32, 32, 32)) - 15.5
    distance = np.sqrt((grid**2).sum(axis=0)).astype(np.float32)
    device = select_device("cpu")
    found = extract_surface(
        upload_volume(band_volume(volume_of(distance), 6, 11), device), SurfaceSettings(isovalue=0.0)
    )
    radii = np.linalg.norm(found.mesh.positions.numpy() - 15.5, axis=1)
    alone = []
    for isovalue, inside in ((6.0, "above"), (11.0, "below")):
        one = extract_surface(
            upload_volume(volume_of(distance), device), SurfaceSettings(isovalue=isovalue, inside=inside)
        )
        alone.append(one.mesh.positions.numpy())
    assert len(radii) == sum(len(points) for points in alone)
    points = np.concatenate(alone)
    mine = found.mesh.positions.numpy()
    order, other = np.lexsort(mine.round(3).T), np.lexsort(points.round(3).T)
    np.testing.assert_allclose(mine[order], points[other], atol=2e-3)


def test_the_command_makes_the_surface_of_a_band_and_says_so(run, tmp_path):
    words = ["convert", "synth:torus:24", tmp_path / "a.ply", "-i", "band:-0.2:0", "--border", "closed"]
    result = run(
        *words, "--report", tmp_path / "a.json", "--require", "closed,manifold,on-surface", "--check"
    )
    assert result.exit_code == 0, result.stderr
    assert "what lies from -0.2 to 0" in result.stderr
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["surface"]["choice"]["band"] == [-0.2, 0.0]
    assert report["settings"]["isovalue"] == "band:-0.2:0"
    assert report["input"]["dtype"] == "float32"
    volumes = []
    for isovalue in ("-0.2", "0"):
        run(*words[:4], isovalue, *words[5:], "--force", "--report", tmp_path / "b.json")
        volumes.append(json.loads((tmp_path / "b.json").read_text())["mesh"]["volume"])
    assert report["mesh"]["volume"] == pytest.approx(volumes[0] - volumes[1], rel=0.02)
    assert len(read_mesh(str(tmp_path / "a.ply")).points)
