"""Walls are as thick as rays say that are tried against every triangle, and as solids are made."""

from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.measures import list_thickness, measure_quality, measure_thickness
from dmc_cli.mesh import mesh_of_file
from dmc_cli.mesh_io import MeshFile, flip_faces
from dmc_cli.runtime import select_device
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import read_volume
from tests.fields import smooth_noise
from tests.measures.splits import split_faces


def on_device(points, faces, device="cpu", threads=2):
    file = MeshFile(points=np.asarray(points, np.float32), faces=np.asarray(faces, np.int32))
    return mesh_of_file(file, select_device(device, threads))


def box(x, y, z, low=(0, 0, 0)):
    """The points and faces of a box that looks outward."""
    corners = np.array([(i & 1, i >> 1 & 1, i >> 2) for i in range(8)]) * (x, y, z) + np.array(low)
    return corners, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def ball(nodes):
    """A ball of radius 0.75."""
    return read_volume(f"synth:sphere:{nodes}", ReadSettings())


def plate(cells, thickness):
    """A plate of square cells on both sides, closed by quads."""
    n = cells + 1
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    flat = np.stack([i.ravel(), j.ravel(), np.zeros(n * n)], axis=1).astype(float)
    at = np.arange(n * n).reshape(n, n)
    squares = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    rim = np.concatenate([at[:-1, 0], at[-1, :-1], at[:0:-1, -1], at[0, :0:-1]])
    following = np.roll(rim, -1)
    sides = np.stack([rim, following, following + n * n, rim + n * n], axis=1)
    faces = np.concatenate([squares[:, ::-1], squares + n * n, sides])
    return np.concatenate([flat, flat + np.array((0, 0, thickness))]), faces


def brute_force(mesh):
    """The thickness at each vertex by all triangles, in NumPy."""
    points, faces = mesh.positions.numpy().astype(float), mesh.faces.numpy()
    last = np.where(faces[:, 3] < 0, faces[:, 2], faces[:, 3])
    normals = np.cross(points[faces[:, 2]] - points[faces[:, 0]], points[last] - points[faces[:, 1]])
    sums = np.zeros_like(points)
    for corner in range(4):
        which = faces[:, corner] >= 0
        np.add.at(sums, faces[which, corner], normals[which])
    found = np.full(len(points), np.nan)
    parts = list(split_faces((mesh.positions.numpy(), faces)))
    owner = np.repeat(np.arange(len(faces)), [len(part) for part in parts])
    corners = points[[triangle for part in parts for triangle in part]]
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    for v in np.flatnonzero(np.linalg.norm(sums, axis=1) > 0):
        along = -sums[v] / np.linalg.norm(sums[v])
        with np.errstate(all="ignore"):
            across = np.cross(ac, along)
            steep = np.einsum("ij,ij->i", across, ab)
            offset = points[v] - a
            u = np.einsum("ij,ij->i", offset, across) / steep
            turned = np.cross(offset, ab)
            w, t = -(turned @ along) / steep, -np.einsum("ij,ij->i", ac, turned) / steep
            hit = (steep > 0) & (u >= -1e-9) & (w >= -1e-9) & (u + w <= 1 + 1e-9) & (t > 0)
        hit &= ~(faces[owner] == v).any(axis=1)
        found[v] = t[hit].min(initial=np.inf)
    found[~np.isfinite(found)] = np.nan
    return found


@pytest.mark.parametrize("thickness", [0.01, 1.0, 30.0])
def test_a_plate_is_as_thick_as_it_is(device, thickness):
    mesh = on_device(*plate(6, thickness), device)
    values = list_thickness(mesh)
    inner = (mesh.positions.numpy()[:, :2] > 0).all(axis=1) & (mesh.positions.numpy()[:, :2] < 6).all(axis=1)
    np.testing.assert_allclose(values[inner], thickness, rtol=1e-6)


def test_a_ball_is_as_thick_as_its_diameter(extract):
    mesh = extract(ball(48), 0.0).mesh
    values = list_thickness(mesh)
    np.testing.assert_allclose(values, 1.5, rtol=0.01)
    told = measure_thickness(mesh, 1.6)
    assert told.vertices == mesh.vertex_count
    assert told.min == values.min()
    assert told.max == values.max()
    assert told.percent_below == pytest.approx(100.0)
    assert measure_thickness(mesh, 1.0).percent_below == 0.0


def test_a_hollow_ball_has_the_thickness_of_its_wall(extract):
    volume = ball(64)
    shell = np.minimum(volume.values, np.float32(0.2) - volume.values)
    mesh = extract(replace(volume, values=shell), 0.0).mesh
    values = list_thickness(mesh)
    assert np.isfinite(values).all()
    assert measure_thickness(mesh).median == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("method", ["dmc", "mc"])
@pytest.mark.parametrize("sigma", [1.0, 3.0])
def test_as_when_every_triangle_is_tried(extract, method, sigma):
    mesh = extract(smooth_noise(14, sigma), 0.0, method=method, border="closed").mesh
    assert measure_quality(mesh).signed_volume > 0
    found = list_thickness(mesh)
    assert np.isfinite(found).mean() > 0.99
    np.testing.assert_allclose(found, brute_force(mesh), rtol=1e-9)


def test_a_mesh_that_looks_inward_has_the_same_walls():
    points, faces = plate(4, 0.5)
    file = MeshFile(points=points.astype(np.float32), faces=faces.astype(np.int32))
    device = select_device("cpu", 2)
    values = [list_thickness(mesh_of_file(one, device)) for one in (file, flip_faces(file))]
    np.testing.assert_array_equal(values[0], values[1])


@pytest.mark.parametrize("threads", [2, 3])
def test_any_number_of_threads_finds_the_same(threads):
    shape = plate(30, 0.25)
    one, several = (list_thickness(on_device(*shape, threads=n)) for n in (1, threads))
    np.testing.assert_array_equal(one, several)


def test_where_no_wall_is_met_there_is_no_thickness():
    points, faces = box(1, 1, 1)
    lid_off = on_device(points, faces[:1])
    assert np.isnan(list_thickness(lid_off)).all()
    told = measure_thickness(lid_off, 1.0)
    assert (told.vertices, told.min, told.percent_below, told.limit) == (0, None, None, 1.0)
    assert np.isnan(list_thickness(on_device(points, np.zeros((0, 4), np.int32)))).all()


def test_a_share_is_one_of_the_area():
    """Two boxes: the thin one's part of the area is what is thinner than the limit."""
    thin, thick = box(1, 1, 0.125), box(4, 4, 4, low=(10, 0, 0))
    faces = [*thin[1], *(tuple(c + 8 for c in face) for face in thick[1])]
    mesh = on_device(np.concatenate([thin[0], thick[0]]), faces)
    told = measure_thickness(mesh, 2.0)
    assert told.percent_below == pytest.approx(100 * 2.5 / (2.5 + 96))


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan, np.inf])
def test_a_limit_is_a_length(limit):
    with pytest.raises(SettingsError, match="expected a positive length"):
        measure_thickness(on_device(*box(1, 1, 1)), limit)
