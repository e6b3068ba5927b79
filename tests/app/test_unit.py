"""The unit of the output: coordinates, area and volume scale, and files and reports say which it is."""

import json

import numpy as np
import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.settings import OutputSettings, OutputUnit, ReadSettings
from dmc_cli.volume.space import UNIT_LENGTHS, output_affine
from dmc_cli.volume.volume import Volume
from dmc_cli.volume_io.read import read_volume

SPHERE = "synth:sphere:12"


@pytest.fixture
def converted(tmp_path, run):
    """Convert the sphere with further words; return its mesh and report."""

    def call(*words, name="a.ply"):
        report = tmp_path / "r.json"
        result = run("convert", SPHERE, tmp_path / name, "-i", 0, "--force", "--report", report, *words)
        assert result.exit_code == 0, result.stderr
        return read_mesh(str(tmp_path / name)), json.loads(report.read_text()), result.stderr

    return call


@pytest.mark.parametrize(("unit", "factor"), [("um", 1e3), ("nm", 1e6), ("m", 1e-3)])
@pytest.mark.parametrize("name", ["a.ply", "a.obj", "a.off"])
def test_everything_is_in_the_unit_that_was_asked_for(converted, unit, factor, name):
    plain, before, _ = converted(name=name)
    mesh, after, told = converted("--unit", unit, name=name)
    assert (plain.unit, mesh.unit) == ("mm", unit)
    np.testing.assert_allclose(mesh.points, plain.points * factor, rtol=1e-6, atol=1e-7 * factor)
    np.testing.assert_array_equal(mesh.faces, plain.faces)
    assert (before["mesh"]["unit"], after["mesh"]["unit"]) == ("mm", unit)
    assert after["mesh"]["area"] == pytest.approx(before["mesh"]["area"] * factor**2, rel=1e-5)
    assert after["mesh"]["volume"] == pytest.approx(before["mesh"]["volume"] * factor**3, rel=1e-5)
    np.testing.assert_allclose(
        after["mesh"]["bounds"], np.array(before["mesh"]["bounds"]) * factor, rtol=1e-6
    )
    assert after["deviation"]["rounding_mm"] == pytest.approx(before["deviation"]["rounding_mm"], rel=1)
    assert f" {unit}\u00b2, volume " in told
    assert f" {unit}\u00b3," in told


@pytest.mark.parametrize("unit", ["mm", "um", "nm", "m"])
def test_measure_takes_the_unit_from_the_file(converted, tmp_path, run, unit):
    converted("--unit", unit)
    words = ["--volume", SPHERE, "-i", 0, "--json"]
    found = json.loads(run("measure", tmp_path / "a.ply", *words).stdout)
    assert (found["mesh"]["unit"], found["warnings"]) == (unit, [])
    assert found["deviation"]["max_mm"] < 1e-6
    assert found["deviation"]["rounding_mm"] < 1e-6


def test_stages_that_move_vertices_keep_the_unit(converted):
    words = ["--simplify", "all", "--relax", 2, "--require", "manifold,on-surface", "--check"]
    plain, _, _ = converted(*words)
    mesh, _, _ = converted(*words, "--unit", "nm")
    np.testing.assert_allclose(mesh.points, plain.points * 1e6, rtol=1e-4, atol=10)


def test_grid_indices_have_no_unit(converted):
    assert converted("--space", "voxel")[1]["mesh"]["unit"] == "voxel"
    with pytest.raises(SettingsError, match="grid indices have no unit"):
        OutputSettings(path="a.ply", space="voxel", unit="um")


def test_coordinates_that_no_float32_holds_are_refused():
    volume = Volume(values=np.zeros((2, 2, 2), np.uint8), affine=np.diag([1e34, 1e34, 1e34, 1]), space="none")
    with pytest.raises(SettingsError, match="choose a larger unit"):
        output_affine(volume, "native", "nm")


def test_millimetres_leave_the_affine_as_it_is():
    volume = read_volume(SPHERE, ReadSettings())
    assert output_affine(volume, "native")[0] is volume.affine
    assert set(UNIT_LENGTHS) == set(OutputUnit.__args__)


@pytest.mark.parametrize("suffix", [".npz", ".txt"])
def test_a_dump_names_a_unit_that_is_not_the_usual_one(converted, tmp_path, suffix):
    def dumped(unit):
        path = tmp_path / f"{unit}{suffix}"
        converted("--unit", unit, "--halfedges", path)
        return path

    plain, scaled = dumped("mm"), dumped("um")
    if suffix == ".npz":
        with np.load(plain) as mm, np.load(scaled) as um:
            before, after = dict(mm), dict(um)
        assert set(after) - set(before) == {"unit"}
        assert after["unit"] == "um"
        np.testing.assert_allclose(after["vertices"], before["vertices"] * 1e3, rtol=1e-6, atol=1e-4)
    else:
        assert plain.read_text().startswith("vertices ")
        assert scaled.read_text().startswith("# UNIT=um\nvertices ")
