"""The cost of rounding coordinates to float32 is measured, reported, and refused where it counts."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dmc_cli.contouring import extract_surface
from dmc_cli.errors import RequirementError, VolumeError
from dmc_cli.field import upload_volume
from dmc_cli.measures.rounding import file_rounding, may_be_coarse
from dmc_cli.measures.rounding_kernels import measure_rounding
from dmc_cli.mesh.near_frame import COARSE
from dmc_cli.report.requirements import check_requirements
from dmc_cli.runtime.device import Device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.space import output_affine
from tests.fields import smooth_noise, volume_of

OBLIQUE = np.array([[0.3, 0.1, 0], [-0.1, 0.3, 0.2], [0, 0.05, -2]])


def far_volume(origin, linear=None, **attributes):
    affine = np.eye(4)
    affine[:3, :3] = np.eye(3) if linear is None else linear
    affine[:3, 3] = origin
    return volume_of(smooth_noise(12).values, affine=affine, **attributes)


def surface_of(volume, device="cpu", border="open", space="native"):
    affine, _ = output_affine(volume, space)
    settings = SurfaceSettings(isovalue=0.0, border=border)
    uploaded = upload_volume(volume, Device(device, 2))
    return extract_surface(uploaded, settings, affine, even_slices=space == "voxel")


def exact_way(surface, v):
    """From where a vertex is to where it is written, in exact numbers."""
    grid, cell = surface.placement.frame.grid, int(surface.placement.cell.numpy()[v])
    node = cell % grid.nx, cell // grid.nx % grid.ny, cell // (grid.nx * grid.ny)
    local = surface.placement.local.numpy()[v].tolist()
    x, y, z = (n + Fraction(u) for n, u in zip(node, local, strict=True))
    depths = surface.placement.frame.depths.numpy().tolist()
    if depths:
        low, high = depths[node[2]], depths[node[2] + 1]
        z = Fraction(low) + Fraction(local[2]) * (Fraction(high) - Fraction(low))
    rows = [[Fraction(a) for a in row] for row in surface.placement.frame.affine[:3].tolist()]
    exact = [a * x + b * y + c * z + d for a, b, c, d in rows]
    written = map(Fraction, surface.mesh.positions.numpy()[v].tolist())
    return np.array([float(p - q) for p, q in zip(written, exact, strict=True)])


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("origin", [(0, 0, 0), (-1e5, 3e4, 10), (1e8, 1e8, -1e8), (1e17, 0, 0)])
def test_the_rounding_is_the_largest_of_all_vertices(device, origin, border):
    volume = far_volume(origin, OBLIQUE)
    surface = surface_of(volume, device, border)
    ways = np.array([exact_way(surface, v) for v in range(surface.mesh.vertex_count)])
    cells = ways @ np.linalg.inv(OBLIQUE).T
    found = measure_rounding(surface.mesh, surface.placement, volume)
    assert found.mm == pytest.approx(np.linalg.norm(ways, axis=1).max(), rel=1e-6)
    assert found.relative == pytest.approx(np.abs(cells).max(), rel=1e-6)


def test_between_uneven_slices_the_share_is_that_of_their_distance(device):
    positions = np.cumsum([0, *np.random.default_rng(2).uniform(0.01, 4, 11)])
    volume = far_volume((0, 0, 1e6), slice_positions=positions)
    surface = surface_of(volume, device)
    ways = np.array([exact_way(surface, v) for v in range(surface.mesh.vertex_count)])
    layers = surface.placement.cell.numpy() // 144
    ways[:, 2] /= np.diff(surface.placement.frame.depths.numpy())[layers]
    assert measure_rounding(surface.mesh, surface.placement, volume).relative == pytest.approx(
        np.abs(ways).max(), rel=1e-6
    )


def test_millimetres_are_told_of_grid_coordinates_too():
    volume = far_volume((1e8, 0, 0), 7.0 * np.eye(3))
    native, voxel = surface_of(volume), surface_of(volume, space="voxel")
    found = measure_rounding(voxel.mesh, voxel.placement, volume)
    assert found.mm == pytest.approx(
        7.0 * max(np.linalg.norm(exact_way(voxel, v)) for v in range(300)), rel=0.5
    )
    assert found.relative < 1e-6 < COARSE < measure_rounding(native.mesh, native.placement, volume).relative
    assert (may_be_coarse(native.placement.frame), may_be_coarse(voxel.placement.frame)) == (True, False)


def test_without_vertices_there_is_no_rounding():
    volume = volume_of(np.zeros((3, 3, 3), np.float32))
    nothing = surface_of(replace(volume, values=volume.values - 1))
    assert measure_rounding(nothing.mesh, nothing.placement, volume) is None


@pytest.mark.parametrize(
    ("origin", "linear", "coarse"),
    [
        (4e3, 1, False),
        (4e4, 1, True),
        (-4e4, 1, True),
        (4e4, 100, False),
        (4.0, 1e-5, True),
        (0, 1e-5, False),
        (0, 1e-44, True),
    ],
)
def test_whether_rounding_may_count_is_seen_by_the_grid(origin, linear, coarse):
    volume = far_volume((0, origin, 0), linear * np.eye(3))
    surface = surface_of(volume)
    assert may_be_coarse(surface.placement.frame) == coarse
    assert coarse or measure_rounding(surface.mesh, surface.placement, volume).relative <= COARSE


def test_coordinates_beyond_float32_are_refused():
    with pytest.raises(VolumeError, match=r"reaches as far as 1e\+39 mm.*--space voxel"):
        surface_of(far_volume((0, 1e39, 0)))
    assert np.isfinite(surface_of(far_volume((0, 1e39, 0)), space="voxel").mesh.positions.numpy()).all()
    nearly = far_volume((3.22e38, 0, 0), 1.6e36 * np.eye(3))
    assert np.isfinite(surface_of(nearly).mesh.positions.numpy()).all()


def test_uneven_slices_that_reach_beyond_float32_are_refused():
    volume = far_volume((0, 0, 3e38), slice_positions=np.arange(12.0) * 2e37)
    with pytest.raises(VolumeError, match=r"reaches as far as 5.2e\+38 mm"):
        surface_of(volume)
    assert np.isfinite(surface_of(volume, space="voxel").mesh.positions.numpy()).all()


def test_the_rounding_of_a_file_is_half_a_step_of_its_largest_coordinates():
    volume = far_volume((0, 0, 0), np.diag([1.0, 2.0, 4.0]))
    points = np.array([[1.5, -(2.0**20) - 1, 3.0], [0.5, 0, 2.0**24 + 2]])
    found = file_rounding(points, volume)
    steps = np.array([2.0**-24, 2.0**-4, 1.0])
    assert found.mm == pytest.approx(np.linalg.norm(steps))
    assert found.relative == 0.25
    assert file_rounding(points + 1e-9, volume).mm == 0.0
    assert file_rounding(np.zeros((0, 3)), volume).relative == 0.0


@pytest.fixture
def ball(tmp_path):
    """Return the words that name a raw volume of a ball of radius 5 at an origin."""
    k, j, i = np.indices((16, 16, 16)) - 7.5
    path = tmp_path / "ball.raw"
    (5 - np.sqrt(i**2 + j**2 + k**2)).astype("<f4").tofile(path)

    def words(origin, spacing=1):
        geometry = (
            "--shape",
            "16,16,16",
            "--dtype",
            "float32",
            "--spacing",
            f"{spacing},{spacing},{spacing}",
        )
        return path, (*geometry, "--origin", f"{origin},{origin},{origin}", "-i", 0)

    return words


def test_far_from_the_origin_what_is_written_is_measured_and_refused(run, ball, tmp_path):
    volume, words = ball(1e8)
    found = run(
        "convert",
        volume,
        tmp_path / "a.ply",
        *words,
        "--report",
        tmp_path / "r.json",
        "--require",
        "on-surface",
    )
    assert found.exit_code == 6
    assert "on-surface: so far from the origin float32 coordinates are off by" in found.stderr
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["warnings"][0].startswith("so far from the origin float32 coordinates are off by up to")
    assert "--space voxel" in report["warnings"][0]
    assert "W-ROUNDING" in report["warning_codes"]
    deviation = report["deviation"]
    assert 4.0 < deviation["rounding_mm"] < 7.0
    assert deviation["max_mm"] > 1.0
    assert not (tmp_path / "a.ply").exists()


def test_without_a_report_the_loss_is_told_on_the_terminal(run, ball, tmp_path):
    volume, words = ball(1e6)
    found = run("convert", volume, tmp_path / "a.ply", *words)
    assert found.exit_code == 0
    assert "warning: so far from the origin float32 coordinates are off by up to 0.046 mm" in found.stderr


@pytest.mark.parametrize(("origin", "space"), [(5e3, "native"), (1e8, "voxel")])
def test_where_rounding_does_not_count_nothing_is_said(run, ball, tmp_path, origin, space):
    volume, words = ball(origin)
    words = (*words, "--space", space, "--report", tmp_path / "r.json", "--require", "on-surface", "--check")
    found = run("convert", volume, tmp_path / "a.ply", *words)
    assert (found.exit_code, "off by" in found.stderr) == (0, False)
    deviation = json.loads((tmp_path / "r.json").read_text())["deviation"]
    assert 0 < deviation["rounding_mm"] < 2e-3
    assert deviation["max_relative"] < 1e-6


def test_a_spacing_of_float32_smallest_steps_is_named_as_the_cause(run, ball, tmp_path):
    volume, words = ball(0, spacing=1e-44)
    words = (*words, "--report", tmp_path / "r.json")
    found = run("convert", volume, tmp_path / "a.ply", *words, "--require", "on-surface")
    assert found.exit_code == 6
    assert "on-surface: with so small a spacing float32 coordinates are off by" in found.stderr
    warning = json.loads((tmp_path / "r.json").read_text())["warnings"][0]
    assert warning.startswith("with so small a spacing float32 coordinates are off by up to 1.1e-45 mm")
    assert warning.endswith("--space voxel, or choose a larger spacing")


def test_a_far_mesh_is_no_bug_of_ours(run, ball, tmp_path):
    volume, words = ball(1e8)
    assert run("convert", volume, tmp_path / "a.ply", *words, "--check", "--simplify", "all").exit_code == 0


def test_a_measured_file_far_from_the_origin_is_warned_of(run, ball, tmp_path):
    volume, words = ball(1e6)
    run("convert", volume, tmp_path / "a.ply", *words, "--quiet")
    found = json.loads(run("measure", tmp_path / "a.ply", "--volume", volume, *words, "--json").stdout)
    assert found["warnings"][0].startswith("so far from the origin float32 coordinates are off by up to")
    assert found["deviation"]["rounding_relative"] == 2.0**-5
    assert 0.01 < found["deviation"]["max_mm"] < 0.06


def test_a_deviation_that_no_vertex_has_does_not_pass():
    section = {"deviation": {"max": None, "max_relative": None}, "mesh": {"vertices": 3}}
    with pytest.raises(RequirementError, match="on-surface: no vertex could be measured"):
        check_requirements(section, ["on-surface"])
    check_requirements(section | {"mesh": {"vertices": 0}}, ["on-surface"])
