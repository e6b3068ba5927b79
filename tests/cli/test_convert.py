"""`dmc convert` end to end: files, streams, exit status."""

import json

import numpy as np
import pytest
import trimesh

TORUS = ["convert", "synth:torus:24"]


@pytest.mark.parametrize("name", ["torus.ply", "torus.obj", "torus.off"])
def test_a_torus_becomes_a_closed_mesh_of_genus_one(run, tmp_path, name):
    result = run(*TORUS, tmp_path / name, "-i", 0)
    assert result.exit_code == 0
    assert result.stdout == ""
    mesh = trimesh.load(tmp_path / name, force="mesh")
    assert mesh.is_watertight
    assert mesh.euler_number == 0
    assert 0.95 < mesh.volume / (2 * np.pi**2 * 0.6 * 0.25**2) < 1  # chords lie inside


def test_the_summary_is_on_standard_error(run, tmp_path):
    result = run(*TORUS, tmp_path / "torus.ply", "-i", 0)
    for words in ("24 x 24 x 24 nodes of float32", "isovalue 0", "quads", "time "):
        assert words in result.stderr
    assert run(*TORUS, tmp_path / "quiet.ply", "-i", 0, "--quiet").stderr == ""


@pytest.mark.parametrize(
    ("volume_space", "asked", "named"),
    [
        ("right-anterior-superior", "native", (" mm, RAS", ", RAS")),
        ("right-anterior-superior", "lps", (" mm, RAS", ", LPS")),
        ("left-posterior-superior", "ras", (" mm, LPS", ", RAS")),
        ("left-posterior-superior", "voxel", (" mm, LPS", ", grid indices")),
        (None, "native", (" mm, no space", ", no space")),
    ],
)
def test_the_summary_names_the_spaces_of_volume_and_mesh(run, tmp_path, volume_space, asked, named):
    space = f"space: {volume_space}" if volume_space else "space dimension: 3"
    header = f"NRRD0005\ntype: uchar\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n{space}\n"
    header += "space directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (0,0,0)\n\n"
    values = np.zeros((4, 4, 4), np.uint8)
    values[1:3, 1:3, 1:3] = 200
    (tmp_path / "cube.nrrd").write_bytes(header.encode() + values.tobytes())
    words = ["convert", tmp_path / "cube.nrrd", tmp_path / "a.ply", "-i", 100, "--space", asked]
    result = run(*words, "--require", "closed")
    assert result.exit_code == 0, result.output
    volume, mesh = (line for line in result.stderr.splitlines() if line.startswith(("volume", "mesh")))
    assert volume.endswith(named[0])
    assert mesh.endswith(named[1])
    assert ("mm²" in mesh) == ("mm³" in mesh) == (asked != "voxel")


def test_standard_output_carries_only_the_report(run_process, tmp_path):
    result = run_process(*TORUS, tmp_path / "torus.ply", "-i", 0, "--report", "-")
    report = json.loads(result.stdout)
    assert report["topology"]["genus"] == 1
    assert report["mesh"]["quads"] > 0
    assert set(report["timings_ms"]) >= {"compile", "read", "surface", "normals", "report", "write", "total"}


def test_standard_output_carries_only_the_mesh(run_process, tmp_path):
    result = run_process(*TORUS, "-", "-i", 0, "--output-format", "off")
    assert result.returncode == 0
    run_process(*TORUS, tmp_path / "torus.off", "-i", 0)
    assert result.stdout == (tmp_path / "torus.off").read_text()


def test_standard_input_is_read(tmp_path, run):
    volume = tmp_path / "torus.nrrd"
    run("synth", "torus", volume, "-n", 24)
    piped = run(
        "convert", "-", tmp_path / "piped.ply", "-i", 0, "--input-format", "nrrd", input=volume.read_bytes()
    )
    assert piped.exit_code == 0
    run("convert", volume, tmp_path / "named.ply", "-i", 0)
    assert (tmp_path / "piped.ply").read_bytes() == (tmp_path / "named.ply").read_bytes()


@pytest.mark.parametrize(
    "options", [[], ["--ascii"], ["--no-normals"], ["--border", "closed"], ["--inside", "below"]]
)
def test_the_same_bytes_whatever_the_threads(run, tmp_path, options):
    names = [tmp_path / f"{threads}.ply" for threads in (1, 2, 5)]
    for name, threads in zip(names, (1, 2, 5), strict=True):
        run("convert", "synth:noise:40", name, "-i", 0.1, "--sigma", 1, "--threads", threads, *options)
    assert names[0].read_bytes() == names[1].read_bytes() == names[2].read_bytes()


def test_an_existing_output_needs_force(run, tmp_path):
    path = tmp_path / "torus.ply"
    path.write_bytes(b"old")
    result = run(*TORUS, path, "-i", 0)
    assert (result.exit_code, path.read_bytes()) == (9, b"old")
    assert "--force" in result.stderr
    assert run(*TORUS, path, "-i", 0, "--force").exit_code == 0
    assert path.read_bytes().startswith(b"ply")


def test_an_empty_surface_ends_with_status_5_naming_the_range(run, tmp_path):
    result = run(*TORUS, tmp_path / "torus.ply", "-i", 7)
    assert result.exit_code == 5
    assert "to 0.2" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_empty_surface_may_be_allowed(run, tmp_path):
    result = run(*TORUS, tmp_path / "torus.ply", "-i", 7, "--allow-empty")
    assert result.exit_code == 0
    assert b"element face 0\n" in (tmp_path / "torus.ply").read_bytes()


def test_a_requirement_that_is_not_met_leaves_the_report_only(run, tmp_path):
    words = ["convert", "synth:iwp:16", tmp_path / "iwp.ply", "-i", 0, "--report", tmp_path / "iwp.json"]
    result = run(*words, "--require", "manifold,closed")
    assert result.exit_code == 6
    assert "closed" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["iwp.json"]
    assert json.loads((tmp_path / "iwp.json").read_text())["topology"]["boundary_edges"] > 0
    assert run(*words, "--require", "manifold,closed", "--border", "closed", "--force").exit_code == 0


@pytest.mark.parametrize("options", [["--check"], ["--check", "--border", "closed"]])
def test_check_accepts_a_sound_mesh(run, tmp_path, options):
    assert run("convert", "synth:noise:20", tmp_path / "noise.ply", "-i", 0, *options).exit_code == 0


def test_a_dry_run_writes_nothing(run, tmp_path):
    assert run(*TORUS, tmp_path / "torus.ply", "-i", 0, "--dry-run").exit_code == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        (["--space", "ras"], 2, "space"),
        (["--space", "lps"], 2, "space"),
        (["--device", "cuda:99"], 7, "cuda:99"),
        (["--memory", "10K"], 7, "KiB|MiB"),
    ],
)
def test_what_cannot_be_done_is_told(run, tmp_path, options, status, message):
    result = run(*TORUS, tmp_path / "torus.ply", "-i", 0, *options)
    assert result.exit_code == status
    assert any(word in result.stderr for word in message.split("|"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "options",
    [
        ["--halfedges", "torus.npz"],
        ["--report", "torus.json"],
        ["--require", "manifold"],
        ["--check"],
        ["--simplify", "all"],
        ["--relax", 1],
    ],
)
def test_the_forecast_counts_halfedges_whatever_they_are_built_for(run, tmp_path, monkeypatch, options):
    monkeypatch.chdir(tmp_path)
    words = [*TORUS, "torus.ply", "-i", 0, "--memory", "160K"]
    assert run(*words, "--dry-run").exit_code == 0
    result = run(*words, *options)
    assert result.exit_code == 7, result.output
    assert "a mesh of 1136 quads need 0." in result.stderr


@pytest.mark.parametrize("asked", ["ras", "lps"])
@pytest.mark.parametrize("name", ["a.npy", "a.raw"])
def test_a_file_without_a_space_has_none_to_convert(run, tmp_path, name, asked):
    values = np.zeros((4, 4, 4), np.uint8)
    values[1:3, 1:3, 1:3] = 200
    np.save(tmp_path / "a.npy", values)
    (tmp_path / "a.raw").write_bytes(values.tobytes())
    words = ["convert", tmp_path / name, tmp_path / "a.ply", "-i", 100, "--space", asked]
    result = run(*words, "--shape", "4,4,4", "--dtype", "uint8")
    assert result.exit_code == 2
    assert f"--space {asked} was asked for, but {tmp_path / name} does not say" in result.stderr
    assert not (tmp_path / "a.ply").exists()


def test_grid_coordinates_on_request(run, tmp_path):
    run(*TORUS, tmp_path / "torus.ply", "-i", 0, "--space", "voxel")
    bounds = trimesh.load(tmp_path / "torus.ply", force="mesh").bounds
    np.testing.assert_allclose(bounds, [[1.725, 1.725, 8.625], [21.275, 21.275, 14.375]], atol=0.1)


def test_a_read_only_place_is_told_before_the_work(run, tmp_path):
    result = run("convert", "synth:iwp:4000", tmp_path / "missing" / "out.ply", "-i", 0)
    assert result.exit_code == 9
    assert "does not exist; create it" in result.stderr


def test_a_full_disk_ends_with_status_9(run):
    result = run(*TORUS, "/dev/full", "-i", 0, "--output-format", "obj")
    assert result.exit_code == 9
    assert "the disk is full" in result.stderr


def test_an_unknown_suffix_is_a_usage_error(run, tmp_path):
    result = run(*TORUS, tmp_path / "torus.stp", "-i", 0)
    assert result.exit_code == 2
    assert "has the suffix .stp; expected one of .ply, .obj, .off" in result.stderr
