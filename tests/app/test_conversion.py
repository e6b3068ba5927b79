"""A conversion refuses, makes, reports and writes between its stages what the settings ask for."""

import json
import os

import numpy as np
import pytest

from dmc_cli import progress
from dmc_cli.app import conversion
from dmc_cli.errors import EmptySurfaceError, RequirementError, VolumeError, WriteError
from dmc_cli.progress import SilentProgress
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, ReadSettings, SurfaceSettings


@pytest.fixture
def convert(tmp_path):
    """Convert with settings of an output, of the mesh or of the whole, and return the result."""

    def call(source="synth:torus:16", isovalue=0.0, mesh=None, progress=None, **output):
        path = output.pop("path", str(tmp_path / "mesh.ply"))
        settings = ConvertSettings(
            input=str(source),
            surface=SurfaceSettings(isovalue=isovalue),
            mesh=mesh or MeshSettings(),
            output=OutputSettings(path=path, **output),
            read=ReadSettings(spacing=(1, 1, 1)),
        )
        return conversion.convert(settings, progress or SilentProgress())

    return call


def saved(tmp_path, values):
    np.save(tmp_path / "volume.npy", values)
    return tmp_path / "volume.npy"


def test_a_constant_volume_is_told_from_an_isovalue_outside_the_range(convert, tmp_path):
    constant = saved(tmp_path, np.full((4, 4, 4), 5, np.int16))
    with pytest.raises(EmptySurfaceError, match="every value is 5; a constant volume has no surface"):
        convert(constant, 3.0)
    ramp = saved(tmp_path, np.arange(64, dtype=np.int16).reshape(4, 4, 4))
    message = "no surface at isovalue 99: the values run from 0 to 63; choose an isovalue inside"
    with pytest.raises(EmptySurfaceError, match=message):
        convert(ramp, 99.0)


def test_a_volume_without_data_is_no_empty_surface(convert, tmp_path):
    with pytest.raises(VolumeError, match="holds no value that is data") as caught:
        convert(saved(tmp_path, np.full((4, 4, 4), np.nan, np.float32)))
    assert caught.value.exit_status == 3
    assert not (tmp_path / "mesh.ply").exists()


def test_normals_are_made_for_the_file_that_asks_for_them(convert, tmp_path):
    dump = tmp_path / "dump.npz"
    bare = convert(normals=False, halfedges=str(dump))
    assert bare.mesh.normals is None
    with np.load(dump) as tables:
        np.testing.assert_allclose(np.linalg.norm(tables["normals"], axis=1), 1, atol=1e-5)
    full = convert(force=True)
    assert full.mesh.normals.shape == full.mesh.points.shape
    assert "normals" not in convert(normals=False, force=True).report["timings_ms"]


def test_colours_of_a_dump_are_proper_whatever_is_simplified(convert, tmp_path):
    for simplify in ("none", "all"):
        dump = tmp_path / f"{simplify}.npz"
        convert(halfedges=str(dump), mesh=MeshSettings(simplify=simplify), force=True)
        with np.load(dump) as tables:
            face, twin = tables["halfedges"][:, 1], tables["halfedges"][:, 3]
            inner = twin >= 0
            colors = tables["face_color"]
            assert (colors[face[inner]] != colors[face[twin[inner]]]).all()
            assert (tables["face_halfedge"] == 4 * np.arange(len(colors))).all()


@pytest.mark.parametrize(
    ("output", "mesh", "stages"),
    [
        ({}, MeshSettings(), {"normals"}),
        ({"normals": False}, MeshSettings(), set()),
        ({"require": ("manifold",)}, MeshSettings(), {"normals", "halfedges", "report"}),
        ({"check": True, "normals": False}, MeshSettings(), {"halfedges", "report"}),
        ({}, MeshSettings(simplify="all"), {"normals", "halfedges", "simplify", "repair"}),
        (
            {},
            MeshSettings(simplify="all", simplify_rules="paper"),
            {"normals", "halfedges", "coloring", "simplify"},
        ),
        ({}, MeshSettings(remesh=1), {"normals", "halfedges", "simplify", "remesh", "repair"}),
        ({}, MeshSettings(quads="50%"), {"normals", "halfedges", "size", "repair"}),
        ({}, MeshSettings(relax=1), {"normals", "halfedges", "relax", "repair"}),
        ({}, MeshSettings(relax=1, repair_intersections=False), {"normals", "halfedges", "relax"}),
    ],
)
def test_only_the_stages_that_are_needed_run(convert, output, mesh, stages):
    always = {"compile", "read", "surface", "write", "total"}
    report = convert(mesh=mesh, **output).report
    assert set(report["timings_ms"]) == always | stages
    assert report["timings_ms"]["total"] >= sum(report["timings_ms"][name] for name in always - {"total"})


@pytest.mark.pool
def test_both_measurements_of_a_simplified_mesh_are_timed(convert, monkeypatch):
    shown = []

    class Listener(SilentProgress):
        def stage(self, name):
            shown.append(name)
            return super().stage(name)

    clock = iter(range(1000))
    monkeypatch.setattr(progress.time, "perf_counter", lambda: next(clock))
    report = convert(mesh=MeshSettings(simplify="3333"), require=("manifold",), progress=Listener()).report
    assert shown.count("measuring") == 2
    assert report["timings_ms"]["report"] == 2 * report["timings_ms"]["normals"] == 2000
    assert [shown[0], shown[-1]] == ["loading kernels", "writing"]


def test_a_dry_run_writes_the_report_alone(convert, tmp_path):
    convert(dry_run=True, report=str(tmp_path / "r.json"), halfedges=str(tmp_path / "h.npz"))
    assert [path.name for path in tmp_path.iterdir()] == ["r.json"]
    assert "write" not in json.loads((tmp_path / "r.json").read_text())["timings_ms"]


def test_where_a_requirement_is_not_met_the_report_alone_is_written(convert, tmp_path):
    with pytest.raises(RequirementError):
        convert("synth:iwp:12", require=("closed",), report=str(tmp_path / "r.json"))
    assert [path.name for path in tmp_path.iterdir()] == ["r.json"]
    assert json.loads((tmp_path / "r.json").read_text())["timings_ms"]["total"] > 0


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device is always full here")
@pytest.mark.parametrize("role", ["path", "halfedges"])
def test_where_the_mesh_cannot_be_written_there_is_no_report(convert, tmp_path, role):
    full = tmp_path / "full.npz"
    full.symlink_to("/dev/full")
    with pytest.raises(WriteError, match="the disk is full"):
        convert(output_format="ply", report=str(tmp_path / "r.json"), **{role: str(full)})
    assert not (tmp_path / "r.json").exists()


def test_warnings_of_the_writer_are_in_the_report(convert, tmp_path):
    report = convert(path=str(tmp_path / "a.off"), report=str(tmp_path / "r.json"), normals=True).report
    assert "OFF files hold no normals: they were left out" in report["warnings"]
    assert json.loads((tmp_path / "r.json").read_text())["warnings"] == report["warnings"]


@pytest.mark.parametrize("role", ["path", "halfedges", "report"])
def test_every_output_is_looked_at_before_any_work(convert, tmp_path, monkeypatch, role):
    monkeypatch.setattr(conversion, "ReadAhead", lambda *_: pytest.fail("the volume was read"))
    there = tmp_path / "there.npz"
    there.write_bytes(b"old")
    names = {"path": "new.ply"} | {role: str(there)}
    with pytest.raises(WriteError, match=r"there\.npz exists already"):
        convert(**names, output_format="ply")
    assert there.read_bytes() == b"old"


def test_grid_coordinates_of_uneven_slices_are_even(convert, tmp_path):
    from dmc_cli.app.read_ahead import ReadAhead
    from dmc_cli.volume.volume import Volume

    values = np.zeros((5, 4, 4), np.uint8)
    values[1:4, 1:3, 1:3] = 200
    volume = Volume(
        values=values, affine=np.eye(4), space="LPS", slice_positions=np.array([0.0, 1.0, 2.0, 3.0, 9.0])
    )

    class Read(ReadAhead):
        def __init__(self):
            pass

        def check(self):
            pass

        def result(self, _progress):
            return volume

    heights = {}
    for space in ("native", "voxel"):
        settings = ConvertSettings(
            input="scan",
            surface=SurfaceSettings(isovalue=100.0),
            output=OutputSettings(path=str(tmp_path / f"{space}.ply"), space=space),
        )
        heights[space] = conversion.convert(settings, ahead=Read()).mesh.points[:, 2].max()
    assert heights["voxel"] < 4 < heights["native"]


def test_kernels_of_several_runs_are_loaded_at_once_and_a_missing_device_left_to_its_run(monkeypatch):
    loaded = []
    monkeypatch.setattr(
        conversion, "load_kernels", lambda device, modules, _: loaded.append((device.name, modules))
    )
    surface, output = SurfaceSettings(isovalue=0.0), OutputSettings(path="a.ply")
    plain = ConvertSettings(input="a", surface=surface, output=output, device="cpu")
    relaxed = ConvertSettings(
        input="a", surface=surface, output=output, device="cpu", mesh=MeshSettings(relax=1)
    )
    absent = ConvertSettings(input="a", surface=surface, output=output, device="cuda:99")
    conversion.load_needed_kernels([absent, plain, relaxed, plain])
    ((name, modules),) = loaded
    assert name == "cpu"
    assert len(modules) == len(set(modules))
    assert set(modules) == {*conversion._needed_kernels(plain), *conversion._needed_kernels(relaxed)}
    conversion.compile_kernels()
    assert {name for name, _ in loaded[1:]} >= {"cpu"}
    assert set(loaded[-1][1]) == set(conversion.every_kernel()) >= set(modules)


@pytest.mark.parametrize(
    ("mesh", "output", "names"),
    [
        (MeshSettings(), {"normals": False}, set()),
        (MeshSettings(), {}, {"normals"}),
        (
            MeshSettings(),
            {"normals": False, "halfedges": "a.npz"},
            {"normals", "coloring"},
        ),
        (MeshSettings(simplify="all"), {}, {"simplify_3x3y", "selection"}),
        (
            MeshSettings(remesh=20),
            {},
            {
                "simplify_3x3y",
                "sweep",
                "steps",
            },
        ),
        (MeshSettings(quads=90), {}, {"costs", "points", "regions", "steps", "sweep"}),
        (MeshSettings(relax=2), {}, {"steps"}),
        (MeshSettings(), {"report": "a.json"}, {"quality", "deviation"}),
    ],
)
def test_a_run_needs_the_kernels_of_its_stages(mesh, output, names):
    settings = ConvertSettings(
        input="a",
        surface=SurfaceSettings(isovalue=0.0),
        output=OutputSettings(path="a.ply", **output),
        mesh=mesh,
    )
    found = {module.__name__.rsplit(".", 1)[1] for module in conversion._needed_kernels(settings)}
    assert found >= names | {"cells"}
    optional = {
        "normals",
        "simplify_3x3y",
        "sweep",
        "relax",
        "quality",
    }
    assert found & optional == (names | ({"normals"} if "normals" not in output else set())) & optional
