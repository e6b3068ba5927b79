"""Normals and values of scenes, GLB and USD, are read where all meshes have them, and turned as these are."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from pxr import Gf, Usd, UsdGeom

from dmc_cli.mesh_io.mesh_file import grouped
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh


@pytest.fixture
def valued(cube):
    """The cube with values of vertices."""
    draws = np.random.default_rng(3)
    values = {
        "thickness": draws.random(8).astype(np.float32),
        "flow": draws.random((8, 3)).astype(np.float32),
    }
    return replace(cube, vertex_values=values)


@pytest.mark.parametrize("suffix", ["glb", "usda"])
def test_normals_and_values_come_back(tmp_path, valued, suffix):
    path = tmp_path / f"a.{suffix}"
    write_mesh(str(path), valued)
    found = read_mesh(path)
    assert found.warnings == ()
    np.testing.assert_array_equal(found.points, valued.points)
    np.testing.assert_array_equal(found.normals, valued.normals)
    assert set(found.vertex_values) == {"thickness", "flow"}
    for name, array in valued.vertex_values.items():
        np.testing.assert_array_equal(found.vertex_values[name], array)
        assert found.vertex_values[name].dtype == np.float32


def test_values_of_faces_come_back_from_usd(tmp_path, cube):
    values = {"quality": np.linspace(0, 1, 6), "number": np.arange(6, dtype=np.int32)}
    write_mesh(str(tmp_path / "a.usda"), replace(cube, face_values=values))
    found = read_mesh(tmp_path / "a.usda").face_values
    for name, array in values.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype


@pytest.mark.parametrize("suffix", ["glb", "usda"])
def test_values_of_all_parts_are_kept_and_those_of_some_told(tmp_path, valued, cube, suffix):
    far = replace(valued, points=valued.points + np.float32(5))
    write_mesh(str(tmp_path / f"a.{suffix}"), grouped({"one": valued, "two": far}))
    found = read_mesh(tmp_path / f"a.{suffix}")
    thickness = valued.vertex_values["thickness"]
    np.testing.assert_array_equal(found.vertex_values["thickness"], np.tile(thickness, 2))
    np.testing.assert_array_equal(found.normals, np.tile(valued.normals, (2, 1)))
    assert len(found.faces) == 12
    assert found.warnings == ()


def test_a_part_without_normals_or_values_is_told(tmp_path, valued):
    scene = trimesh.Scene()
    box = trimesh.creation.box()
    box.vertex_attributes["depth"] = np.arange(len(box.vertices), dtype=np.float32)
    scene.add_geometry(box, node_name="a")
    scene.add_geometry(trimesh.creation.icosahedron(), node_name="b")
    scene.export(str(tmp_path / "a.glb"), include_normals=False)
    found = read_mesh(tmp_path / "a.glb")
    assert not found.vertex_values
    assert found.normals is None
    assert "depth of some parts" in found.warnings[0].sentence


def test_normals_are_turned_with_the_nodes_of_a_glb(tmp_path, cube):
    """Twice as large along one axis, in metres with y up: by the inverse transpose, as trimesh has them."""
    write_mesh(str(tmp_path / "a.glb"), cube)
    data = (tmp_path / "a.glb").read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    document = json.loads(data[20 : 20 + size])
    document["nodes"][0] = {"mesh": 0, "scale": [1.0, 2.0, 1.0], "rotation": [0.5, 0.5, 0.5, 0.5]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = b"glTF" + struct.pack("<III", 2, len(data) - size + len(text), len(text)) + b"JSON"
    (tmp_path / "b.glb").write_bytes(head + text + data[20 + size :])
    found = read_mesh(tmp_path / "b.glb")
    z_up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    cycle = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # what that rotation does to x, y, z
    linear = z_up @ cycle @ np.diag([1.0, 2, 1])
    np.testing.assert_allclose(found.points, 1000 * cube.points @ linear.T, atol=1e-3)
    expected = cube.normals @ np.linalg.inv(linear)
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    np.testing.assert_allclose(found.normals, expected, atol=1e-6)


def test_normals_are_turned_with_the_meshes_of_a_stage(tmp_path, cube):
    write_mesh(str(tmp_path / "a.usda"), cube)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/dmc/mesh"))
    mesh.AddTransformOp().Set(Gf.Matrix4d().SetScale(Gf.Vec3d(1, 2, 4)))
    stage.GetRootLayer().Export(str(tmp_path / "b.usda"))
    found = read_mesh(tmp_path / "b.usda")
    x, y, z = (cube.points * [1, 2, 4]).T
    np.testing.assert_allclose(found.points, np.column_stack([x, -z, y]), atol=1e-6)
    x, y, z = (cube.normals / [1, 2, 4]).T
    expected = np.column_stack([x, -z, y])
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    np.testing.assert_allclose(found.normals, expected, atol=1e-6)
