"""A mesh of triangles, or of triangles and quads, goes through every stage that makes sense for it."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from dmc_cli.app.measurement import measure_mesh
from dmc_cli.contouring import compute_normals, connect_faces
from dmc_cli.errors import SettingsError
from dmc_cli.measures.quality import measure_quality
from dmc_cli.measures.topology import measure_topology
from dmc_cli.mesh.check import check_mesh
from dmc_cli.mesh.check_halfedges import check_halfedges
from dmc_cli.mesh.compaction import fill_gaps, pack
from dmc_cli.mesh.connectivity import connect
from dmc_cli.mesh.mesh_files import file_of_mesh, mesh_of_file
from dmc_cli.mesh.near_frame import in_frame_of, in_near_frame
from dmc_cli.mesh.placement import Placement
from dmc_cli.mesh.working import working_mesh
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from dmc_cli.processing.patterns import simplify
from dmc_cli.processing.relaxation import relax
from dmc_cli.processing.remeshing import remesh
from dmc_cli.report.measures import measure_surface
from dmc_cli.runtime.device import Device
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, SurfaceSettings
from tests import shapes
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import sphere
from tests.mesh.meshes import on_device

DEVICE = Device("cpu", 2)
SHARES = {"triangles": 1, "triangles and quads": 3}
SETTINGS = SurfaceSettings(isovalue=0.0, border="closed")


@pytest.fixture(params=SHARES)
def every(request):
    return SHARES[request.param]


@pytest.fixture
def ball(every):
    """A sphere's surface, as quads and with quads cut in two."""
    volume = sphere(12)
    surface = connect_faces(extract_on("cpu", volume, SETTINGS))
    shape = shapes.halved((surface.mesh.positions.numpy(), surface.mesh.faces.numpy()), every)
    return volume, surface, connect(on_device(shape, DEVICE))


def test_it_is_measured_as_the_surface_that_it_is(ball):
    volume, surface, mesh = ball
    found = measure_surface(mesh, surface.placement, volume, intersections=True)
    expected = measure_surface(surface.mesh, surface.placement, volume, intersections=True)
    for name in ("components", "euler_characteristic", "genus", "boundary_edges", "non_manifold_edges"):
        assert getattr(found.topology, name) == getattr(expected.topology, name)
    assert found.deviation == expected.deviation
    assert found.quality.area == pytest.approx(expected.quality.area, rel=0.01)
    assert found.quality.signed_volume == pytest.approx(expected.quality.signed_volume, rel=0.01)
    assert found.quality.bounds == expected.quality.bounds


def test_it_passes_the_checks_and_a_spoilt_one_does_not(ball):
    volume, surface, mesh = ball
    found = measure_surface(mesh, surface.placement, volume, intersections=True)
    report = {
        "deviation": {"max_relative": found.deviation.max_relative},
        "topology": {"non_manifold_edges": 0, "non_manifold_vertices": 0},
    }
    settings = ConvertSettings(input="a", surface=SETTINGS, output=OutputSettings(path="a.ply"))
    normals = compute_normals(surface.placement, SETTINGS)
    check_mesh(mesh, surface.placement, normals, report, settings)
    mesh.faces.numpy()[-1, 2] = mesh.faces.numpy()[-1, 1]
    with pytest.raises(Exception, match=r"halfedge \d+|has a vertex twice"):
        check_mesh(mesh, surface.placement, normals, report, settings)


def test_it_moves_from_frame_to_frame(ball):
    _, surface, mesh = ball
    far = surface.placement.frame.affine.copy()
    far[:3, 3] = 1e6
    moved, placement = in_frame_of(far, mesh, surface.placement)
    near, placement = in_near_frame(moved, placement)
    assert np.abs(near.positions.numpy()).max() < 100
    assert near.faces is mesh.faces


@pytest.mark.parametrize("in_order", [False, True])
def test_gaps_are_closed_round_it(every, in_order):
    ball, torus = (shapes.halved(shape, every) for shape in (shapes.sphere(4), shapes.torus()))
    points, faces = shapes.joined(ball, torus)
    mesh = connect(on_device((points, faces), DEVICE))
    labels = np.repeat([[1, 0], [2, 0]], [len(ball[1]), len(torus[1])], axis=0).astype(np.int32)
    mesh = mesh.with_face_values({"labels": wp.array(labels, dtype=wp.vec2i, device="cpu")})
    cells = wp.array(np.arange(len(points)), dtype=wp.int64, device="cpu")
    frame = extract_on("cpu", sphere(8), SETTINGS).placement.frame
    work = working_mesh(mesh, Placement(cells, wp.clone(mesh.positions), frame))
    work.arrays.face_gone.numpy()[: len(ball[1])] = 1
    work.arrays.vertex_gone.numpy()[: len(ball[0])] = 1
    result, placement = pack(work)[0].as_mesh() if in_order else fill_gaps(work)
    assert (result.vertex_count, result.face_count) == (len(torus[0]), len(torus[1]))
    halfedges = result.halfedges
    check_halfedges(result.faces.numpy(), halfedges.twin.numpy(), halfedges.vertex_halfedge.numpy())
    assert (result.face_values["labels"].numpy() == [2, 0]).all()
    np.testing.assert_array_equal(placement.local.numpy(), result.positions.numpy())
    expected = measure_topology(on_device(torus, DEVICE))
    assert measure_topology(result) == expected
    assert measure_quality(result).area == pytest.approx(measure_quality(on_device(torus, DEVICE)).area)
    if in_order:
        np.testing.assert_array_equal(result.faces.numpy(), torus[1])
        np.testing.assert_array_equal(placement.cell.numpy(), len(ball[0]) + np.arange(len(torus[0])))


@pytest.mark.parametrize("name", ["a.ply", "a.obj", "a.off"])
def test_files_hold_it(ball, tmp_path, name):
    _, _, mesh = ball
    written = file_of_mesh(mesh, space="RAS")
    write_mesh(str(tmp_path / name), written)
    read = read_mesh(tmp_path / name)
    np.testing.assert_array_equal(read.faces, written.faces)
    again = mesh_of_file(read, DEVICE)
    assert again.triangle_count == mesh.triangle_count > 0
    report = measure_mesh(DEVICE, read)
    assert report["mesh"]["triangles"] == mesh.triangle_count
    assert report["mesh"]["quads"] == mesh.face_count - mesh.triangle_count
    assert report["topology"]["genus"] == 0


def test_stages_that_act_on_quads_refuse_it(ball):
    _, surface, mesh = ball
    for stage in (
        lambda: simplify(mesh, surface.placement, MeshSettings(simplify="all")),
        lambda: remesh(mesh, surface.placement, 1),
        lambda: relax(mesh, surface.placement, 1),
    ):
        with pytest.raises(SettingsError, match="faces are triangles"):
            stage()


def test_values_stay_with_their_faces_and_vertices():
    """Two blobs, each with a label: whatever stages remove and open, no label is lost or strays."""
    volume = sphere(10)
    values = np.concatenate([volume.values, volume.values])
    surface = connect_faces(extract_on("cpu", replace(volume, values=values), SETTINGS))
    mesh, placement = surface.mesh, surface.placement
    half = values.shape[0] / 2 + placement.frame.grid.border
    nx, ny = placement.frame.grid.nx, placement.frame.grid.ny
    upper = placement.cell.numpy() // (nx * ny) + 0.5 >= half
    of_face = upper[mesh.faces.numpy()[:, 0]]
    labels = wp.array(np.stack([1 + of_face, 3 * of_face], axis=1).astype(np.int32), dtype=wp.vec2i)
    mesh = replace(mesh, vertex_values={"upper": wp.array(upper.astype(np.float32))})
    result = simplify(mesh.with_face_values({"labels": labels}), placement, MeshSettings(simplify="all"))
    for found in (result, remesh(result.mesh, result.placement, 6)):
        upper = found.placement.cell.numpy() // (nx * ny) + 0.5 >= half
        of_face = upper[found.mesh.faces.numpy()[:, 0]]
        np.testing.assert_array_equal(found.mesh.vertex_values["upper"].numpy(), upper)
        expected = np.stack([1 + of_face, 3 * of_face], axis=1)
        np.testing.assert_array_equal(found.mesh.face_values["labels"].numpy(), expected)
        assert set(found.mesh.vertex_values) == {"upper"}
