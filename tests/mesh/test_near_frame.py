"""A mesh of any spacing, and far from the origin, is changed as it is near the origin with a spacing of 1."""

from dataclasses import replace
from operator import attrgetter

import numpy as np
import pytest
import warp as wp

from dmc_cli.app.conversion import convert
from dmc_cli.errors import MeshInvariantError
from dmc_cli.mesh.near_frame import in_frame_of, in_near_frame
from dmc_cli.processing import relax, remesh, simplify
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, ReadSettings, SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import smooth_noise, volume_of


@pytest.fixture
def changed(tmp_path):
    """Positions in spacings from the origin, and quads, of noise after simplification and relaxation."""
    smooth_noise(20, sigma=1.5).values.tofile(tmp_path / "noise.raw")

    def run(spacing, origin, **mesh):
        read = ReadSettings(shape=(20,) * 3, dtype="float32", spacing=(spacing,) * 3, origin=(origin,) * 3)
        settings = ConvertSettings(
            input=str(tmp_path / "noise.raw"),
            read=read,
            surface=SurfaceSettings(isovalue=0.0),
            mesh=MeshSettings(**mesh),
            output=OutputSettings(path=str(tmp_path / "a.ply"), force=True),
            device="cpu",
            threads=2,
        )
        mesh = convert(settings).mesh
        return (mesh.points.astype(float) - origin) / spacing, mesh.faces, mesh.normals

    return run


@pytest.mark.parametrize(
    ("spacing", "origin", "mesh"),
    [
        (2.0**-80, 0, {"simplify": "all", "relax": 2}),
        (2.0**90, 0, {"simplify": "3333", "relax": 1}),
        (1.0, 1e6, {"simplify": "all", "relax": 1}),
        (2.0**-10, 1e4, {"relax": 2}),
        (2.0**-70, 2.0**-50, {"remesh": 1}),
    ],
)
def test_the_mesh_is_the_same_in_any_frame(changed, spacing, origin, mesh):
    expected, quads, normals = changed(1.0, 0.0, **mesh)
    found, same_quads, same_normals = changed(spacing, origin, **mesh)
    np.testing.assert_array_equal(same_quads, quads)
    rounding = 2.0**-24 * origin / spacing
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 + 2 * rounding)
    np.testing.assert_allclose(same_normals, normals, rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    ("spacing", "origin", "is_near"),
    [
        ((1, 1, 1), (0, 0, 0), True),
        ((1, 1, 1), (1.5e4, -1.5e4, 1.5e4), True),
        ((1, 1, 1), (0, -2e4, 0), False),
        ((1e-3, 1, 1), (0, 1e4, 0), True),
        ((1e-3, 1, 1), (1e2, 0, 0), False),
        ((2e-6, 1, 5e5), (0, 0, 0), True),
        ((1e-7, 1, 1), (0, 0, 0), False),
        ((1, 1, 1e7), (0, 0, 0), False),
    ],
)
def test_only_what_float32_cannot_reckon_with_gets_a_frame_of_its_own(spacing, origin, is_near):
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = origin
    volume = volume_of(smooth_noise(10).values, affine=affine)
    surface = extract_on("cpu", volume, SurfaceSettings(isovalue=0.0))
    mesh, placement = in_near_frame(surface.mesh, surface.placement)
    assert (mesh is surface.mesh) == (placement is surface.placement) == is_near
    near = placement.frame.affine
    back, _ = in_frame_of(surface.placement.frame.affine, mesh, placement)
    assert (back is surface.mesh) == is_near
    assert back.positions.numpy().tobytes() == surface.mesh.positions.numpy().tobytes()
    if not is_near:
        assert np.abs(near[:3, 3]).max() == 0
        ratio = np.diag(near)[:3] / spacing
        assert ratio.min() == ratio.max() == 2.0 ** np.round(np.log2(ratio[0]))


def test_a_vertex_that_leaves_its_cell_on_the_way_is_refused(changed, monkeypatch):
    def spoil(mesh, placement, *_):
        local = placement.local.numpy().copy()
        local[7] = 0.5, 1.25, 0.0
        return mesh, replace(placement, local=wp.array(local, dtype=wp.vec3, device="cpu"))

    monkeypatch.setattr("dmc_cli.processing.relax", spoil)
    with pytest.raises(MeshInvariantError, match=r"vertex 7 lies at \(0.5, 1.25, 0\) of its cell, one of 1 "):
        changed(1.0, 0.0, relax=1)


@pytest.mark.parametrize(
    "stage",
    [
        lambda mesh, placement: relax(mesh, placement, 1),
        lambda mesh, placement: attrgetter("mesh", "placement")(remesh(mesh, placement, 1)),
        lambda mesh, placement: attrgetter("mesh", "placement")(
            simplify(mesh, placement, MeshSettings(simplify="all"))
        ),
    ],
)
def test_a_stage_gives_back_the_frame_that_it_got(stage):
    affine = np.eye(4)
    affine[:3, 3] = 1e6
    volume = volume_of(smooth_noise(10).values, affine=affine)
    surface = extract_on("cpu", volume, SurfaceSettings(isovalue=0.0))
    mesh, placement = stage(surface.mesh, surface.placement)
    np.testing.assert_array_equal(placement.frame.affine, affine)
    np.testing.assert_array_equal(mesh.positions.numpy(), placement.positions().numpy())
    assert np.abs(mesh.positions.numpy() - 1e6).max() < 20
