"""Values of vertices and faces in PLY files."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.errors import CallError
from dmc_cli.mesh_io.mesh_file import LABELS, MeshFile
from dmc_cli.mesh_io.ply import items
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests.mesh_io.mixed import mixed_meshes


def again(folder, mesh, *, ascii=False):
    """Write and read a mesh."""
    path = folder / "mesh.ply"
    assert write_mesh(str(path), mesh, ascii=ascii, force=True).warnings == ()
    return read_mesh(path)


def check_same(found, expected):
    """Names in their order, types, numbers: NaN equals NaN, and -0 does not equal 0."""
    assert list(found) == list(expected)
    for name, array in expected.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)
        assert not ((np.signbit(found[name]) ^ np.signbit(array)) & ~np.isnan(array)).any()


@given(mesh=mixed_meshes(with_values=True), ascii=st.booleans())
def test_all_that_a_mesh_has_comes_back(tmp_path_factory, mesh, ascii):
    found = again(tmp_path_factory.mktemp("values"), mesh, ascii=ascii)
    np.testing.assert_array_equal(found.points.astype(np.float32), mesh.points.astype(np.float32))
    np.testing.assert_array_equal(found.faces, mesh.faces)
    assert (found.normals is None) == (mesh.normals is None)
    if mesh.normals is not None:
        np.testing.assert_array_equal(found.normals, mesh.normals)
    assert found.space == mesh.space
    check_same(found.vertex_values, mesh.vertex_values)
    check_same(found.face_values, mesh.face_values)


@pytest.fixture
def house():
    """A quad and two triangles, with values."""
    return MeshFile(
        points=np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], np.float32),
        faces=np.array([[1, 4, 2, -1], [0, 1, 2, 3], [0, 2, 4, -1]], np.int32),
        vertex_values={"thickness": np.array([0.1, np.nan, -np.inf, np.inf, 5], np.float32)},
        face_values={
            LABELS: np.array([[1, 0], [2, 300], [-1, 70000]], np.int32),
            "kind": np.arange(3, dtype="u1"),
        },
    )


def test_the_text_of_a_file_with_values(tmp_path, house):
    path = tmp_path / "house.ply"
    write_mesh(str(path), house, ascii=True)
    assert path.read_text().splitlines()[3:] == [
        "element vertex 5",
        *(f"property float {name}" for name in ("x", "y", "z", "thickness")),
        "element face 3",
        "property list uchar int vertex_indices",
        "property int labels_0",
        "property int labels_1",
        "property uchar kind",
        "end_header",
        *("0.0 0.0 0.0 0.1", "1.0 0.0 0.0 nan", "1.0 1.0 0.0 -inf", "0.0 1.0 0.0 inf", "2.0 0.0 0.0 5.0"),
        *("3 1 4 2 1 0 0", "4 0 1 2 3 2 300 1", "3 0 2 4 -1 70000 2"),
    ]


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize(
    "names", [("a_0", "a_1"), ("a_0", "a_1", "a_2"), ("b", "a_0", "a_1"), ("a_0", "a_1", "b_0", "b_1")]
)
def test_numbers_that_are_named_like_a_vector_are_one(tmp_path, house, names, ascii):
    columns = {name: np.arange(5, dtype="i2") + 10 * i for i, name in enumerate(names)}
    found = again(tmp_path, replace(house, vertex_values=columns), ascii=ascii).vertex_values
    assert found["a"].tolist() == np.transpose([v for name, v in columns.items() if "a_" in name]).tolist()
    assert set(found) == {name.split("_")[0] for name in names}


@pytest.mark.parametrize(
    "columns",
    [
        {"a_0": "i2", "a_1": "i4"},
        {"a_0": "i2", "a_2": "i2"},
        {"a_1": "i2", "a_2": "i2"},
        {"a_1": "i2", "a_0": "i2"},
        {"a_0": "i2", "b": "i2", "a_1": "i2"},
        {"a_0": "i2", "a_1": "i2", "a": "i2"},
        {"_0": "i2", "_1": "i2"},
    ],
)
def test_other_numbers_stay_numbers(tmp_path, house, columns):
    values = {name: np.arange(5, dtype=kind) for name, kind in columns.items()}
    check_same(again(tmp_path, replace(house, vertex_values=values)).vertex_values, values)


@pytest.mark.parametrize("name", ["x", "nx", "a_1"])
def test_a_name_that_two_properties_would_have_is_refused(tmp_path, house, name):
    values = {"a": np.zeros((5, 2)), name: np.zeros(5)}
    mesh = replace(house, normals=house.points, vertex_values=values)
    with pytest.raises(CallError, match=f"the values a, {name} would make 2 .* called {name};"):
        write_mesh(str(tmp_path / "a.ply"), mesh)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("odd", [np.nan, np.inf, 1e39])
def test_normals_that_are_no_numbers_are_values(tmp_path, house, odd):
    normals = {name: np.full(5, odd) for name in ("nx", "ny", "nz")}
    found = again(tmp_path, replace(house, vertex_values=normals))
    assert found.normals is None
    check_same(found.vertex_values, normals)


def test_numbers_of_a_text_that_are_not_of_their_type_are_doubles(tmp_path):
    text = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property uchar red
property uchar green
property char level
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
0 0 0 255 0.5 -128 256
1 0 0 0 1 nan 0
1 1 0 1 0 127 0
3 0 1 2
"""
    (tmp_path / "a.ply").write_text(text)
    found = read_mesh(tmp_path / "a.ply").vertex_values
    assert {name: array.dtype.str[1:] for name, array in found.items()} == {
        "red": "u1",
        "green": "f8",
        "level": "f8",
        "blue": "f8",
    }
    assert found["red"].tolist() == [255, 0, 1]
    assert found["green"].tolist() == [0.5, 1, 0]


@pytest.mark.parametrize("places", [1, 20, 61, 1000, 1 << 15])
@pytest.mark.parametrize("ascii", [False, True])
def test_pieces_of_mixed_faces_do_not_show(tmp_path, grid, monkeypatch, places, ascii):
    draws = np.random.default_rng(1)
    faces = grid.faces[:3000].copy()
    faces[:1500][draws.random(1500) < 0.5, 3] = -1
    faces[2500::2, 3] = -1
    values = {LABELS: draws.integers(-9, 9, (3000, 2)).astype("i4"), "area": draws.random(3000)}
    monkeypatch.setattr(items, "MIXED_PLACES", places)
    found = again(tmp_path, replace(grid, faces=faces, face_values=values), ascii=ascii)
    np.testing.assert_array_equal(found.faces, faces)
    check_same(found.face_values, values)


def test_alternating_faces_are_read_in_few_steps(tmp_path, grid, monkeypatch):
    faces = grid.faces.copy()
    faces[::2, 3] = -1
    steps = itertools.count()
    longest_run = items._longest_run
    monkeypatch.setattr(items, "_longest_run", lambda *words: (next(steps), longest_run(*words))[1])
    np.testing.assert_array_equal(again(tmp_path, replace(grid, faces=faces)).faces, faces)
    assert next(steps) < len(faces) / 1000
