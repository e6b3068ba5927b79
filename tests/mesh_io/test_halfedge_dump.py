"""The halfedge dump: every table of the command line's page, the same bytes each time, the same in text."""

import io
import json
import zipfile

import numpy as np
import pytest

from dmc_cli.mesh.check_halfedges import check_halfedges
from dmc_cli.mesh.twins import pair_halfedges
from dmc_cli.mesh_io import halfedge_dump
from tests import shapes

SHAPES = {
    "vertices": ("V", 3),
    "normals": ("V", 3),
    "quads": ("Q", 4),
    "halfedges": ("4Q", 4),
    "vertex_halfedge": ("V",),
    "face_halfedge": ("Q",),
    "face_color": ("Q",),
    "face_color24": ("Q",),
    "vertex_color": ("V",),
}
TYPES = dict.fromkeys(SHAPES, "int32") | {
    "vertices": "float32",
    "normals": "float32",
    "face_color": "uint8",
    "face_color24": "uint8",
    "vertex_color": "uint8",
}


def dump(run, folder, suffix, *words):
    path = folder / f"dump{suffix}"
    arguments = [
        "convert",
        "synth:genus_two:24",
        folder / "mesh.ply",
        "-i",
        0,
        "--halfedges",
        path,
        "--force",
    ]
    assert run(*arguments, "--quiet", *words).exit_code == 0
    return path


@pytest.mark.parametrize("simplify", ["none", "all"])
def test_the_archive_holds_the_tables_with_their_shapes_and_types(run, tmp_path, simplify):
    with np.load(dump(run, tmp_path, ".npz", "--simplify", simplify)) as file:
        tables = dict(file)
    assert list(tables) == list(SHAPES)
    sizes = {"V": len(tables["vertices"]), "Q": len(tables["quads"]), "4Q": 4 * len(tables["quads"])}
    for name, table in tables.items():
        assert table.shape == tuple(sizes.get(size, size) for size in SHAPES[name])
        assert table.dtype == TYPES[name]
    origin, face, following, twin = tables["halfedges"].T
    h = np.arange(len(origin))
    np.testing.assert_array_equal(origin, tables["quads"].ravel())
    np.testing.assert_array_equal(face, h // 4)
    np.testing.assert_array_equal(following[following[following[following]]], h)
    np.testing.assert_array_equal(origin[twin], origin[following])
    np.testing.assert_array_equal(tables["face_halfedge"], np.arange(0, len(h), 4))
    check_halfedges(tables["quads"], twin, tables["vertex_halfedge"])
    assert (tables["face_color"][face] != tables["face_color"][face[twin]]).all()
    assert tables["face_color"].max() < 5
    assert tables["face_color24"].max() < 24
    assert tables["vertex_color"].max() < 8


def test_the_text_holds_the_same_numbers(run, tmp_path):
    with np.load(dump(run, tmp_path, ".npz")) as file:
        expected = dict(file)
    lines = dump(run, tmp_path, ".txt").read_text().splitlines()
    found = {}
    while lines:
        name, rows, columns, dtype = lines.pop(0).split()
        table = np.array([line.split() for line in lines[: int(rows)]], dtype=dtype)
        assert table.shape == (int(rows), int(columns))
        found[name] = table.reshape(expected[name].shape)
        del lines[: int(rows)]
    assert list(found) == list(expected)
    for name, table in expected.items():
        np.testing.assert_array_equal(found[name], table)


def test_the_same_mesh_gives_the_same_bytes(run, tmp_path):
    first = dump(run, tmp_path, ".npz", "--simplify", "all").read_bytes()
    assert dump(run, tmp_path, ".npz", "--simplify", "all", "--threads", 1).read_bytes() == first


@pytest.mark.parametrize("suffix", [".npz", ".txt"])
def test_the_pieces_that_it_is_written_in_do_not_show(run, tmp_path, monkeypatch, suffix):
    whole = dump(run, tmp_path, suffix).read_bytes()
    monkeypatch.setattr(halfedge_dump, "CHUNK_ROWS", 1000)
    assert dump(run, tmp_path, suffix).read_bytes() == whole


def test_the_archive_is_what_numpy_writes(run, tmp_path):
    path = dump(run, tmp_path, ".npz")
    with zipfile.ZipFile(path) as archive, np.load(path) as file:
        for name in file:
            stream = io.BytesIO()
            np.save(stream, file[name])
            assert archive.read(f"{name}.npy") == stream.getvalue()
            assert archive.getinfo(f"{name}.npy").date_time == (1980, 1, 1, 0, 0, 0)


def test_entries_of_the_archive_tell_no_time_and_are_not_packed(run, tmp_path):
    """The same bytes tomorrow; a reader may map the tables."""
    with zipfile.ZipFile(dump(run, tmp_path, ".npz")) as archive:
        entries = archive.infolist()
    assert [entry.filename for entry in entries] == [f"{name}.npy" for name in SHAPES]
    for entry in entries:
        assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        assert entry.compress_type == zipfile.ZIP_STORED


def test_the_dump_of_an_empty_surface_has_empty_tables(run, tmp_path):
    path = tmp_path / "empty.npz"
    words = [
        "convert",
        "synth:sphere:8",
        tmp_path / "mesh.ply",
        "-i",
        99,
        "--allow-empty",
        "--halfedges",
        path,
    ]
    assert run(*words, "--simplify", "all", "--check", "--report", tmp_path / "r.json").exit_code == 0
    with np.load(path) as file:
        assert all(len(file[name]) == 0 for name in SHAPES)


def test_an_existing_dump_is_not_overwritten_without_force(run, tmp_path):
    path = tmp_path / "dump.npz"
    path.write_bytes(b"old")
    result = run("convert", "synth:sphere:8", tmp_path / "mesh.ply", "-i", 0, "--halfedges", path)
    assert result.exit_code == 9
    assert path.read_bytes() == b"old"
    assert not (tmp_path / "mesh.ply").exists()


def test_the_report_tells_what_simplification_did(run, tmp_path):
    report = tmp_path / "report.json"
    words = ["convert", "synth:genus_two:64", tmp_path / "m.ply", "-i", 0, "--check", "--report", report]
    paper = ["--simplify", "all", "--simplify-rules", "paper", "--topology", "asymptotic"]
    assert run(*words, *paper).exit_code == 0
    found = json.loads(report.read_text())
    before = found["simplification"].pop("before")
    assert before["topology"]["irregular_percent"] == pytest.approx(43.370, abs=5e-4)
    assert found["simplification"] == {
        "removed_3x3y": 865 + 68,
        "removed_3333": 0,
        "refused": 0,
        "irregular_percent_before": pytest.approx(43.370, abs=5e-4),
        "irregular_percent_after": pytest.approx(8.85, abs=5e-3),
    }
    assert found["mesh"]["quads"] == 8827
    assert found["topology"]["irregular_percent"] == pytest.approx(8.85, abs=5e-3)
    assert {"halfedges", "coloring", "simplify"} <= set(found["timings_ms"])


def test_without_simplification_the_section_is_null(run, tmp_path):
    report = tmp_path / "report.json"
    assert run("convert", "synth:sphere:8", tmp_path / "m.ply", "-i", 0, "--report", report).exit_code == 0
    assert json.loads(report.read_text())["simplification"] is None


def plain_halfedges(faces, twins):
    """Origin, face, next and twin of each row, one after the other."""
    rows = []
    for f, face in enumerate(faces.tolist()):
        sides = 3 if face[3] < 0 else 4
        for c in range(4):
            following = 4 * f + (c + 1) % sides if c < sides else -1
            rows.append([face[c], f, following, twins[4 * f + c]])
    return rows


@pytest.mark.parametrize("rows", [1, 2, 3, 7, 1 << 15])
@pytest.mark.parametrize("suffix", [".npz", ".txt"])
@pytest.mark.parametrize(
    "shape",
    [shapes.tetrahedron(), shapes.house(), shapes.cube(), shapes.joined(shapes.cube(), shapes.house())],
)
def test_triangles_have_three_halfedges_and_a_row_without(tmp_path, monkeypatch, shape, suffix, rows):
    points, faces = shape
    points = points.astype(np.float32)
    twins = pair_halfedges(faces)
    color = np.zeros(len(faces), np.uint8)
    starts = np.array([np.flatnonzero(faces.ravel() == v)[0] for v in range(len(points))], np.int32)
    made = halfedge_dump.HalfedgeDump(
        vertices=points,
        normals=points,
        quads=faces,
        twin=twins,
        vertex_halfedge=starts,
        face_color=color,
        face_color24=color,
        vertex_color=np.zeros(len(points), np.uint8),
    )
    monkeypatch.setattr(halfedge_dump, "CHUNK_ROWS", rows)
    path = tmp_path / f"dump{suffix}"
    halfedge_dump.write_halfedges(str(path), made)
    if suffix == ".npz":
        with np.load(path) as file:
            found, quads = file["halfedges"], file["quads"]
    else:
        lines = path.read_text().splitlines()
        first = lines.index(f"halfedges {4 * len(faces)} 4 int32") + 1
        found = np.array([line.split() for line in lines[first : first + 4 * len(faces)]], int)
        first = lines.index(f"quads {len(faces)} 4 int32") + 1
        quads = np.array([line.split() for line in lines[first : first + len(faces)]], int)
    assert found.tolist() == plain_halfedges(faces, twins)
    np.testing.assert_array_equal(quads, faces)
    origin, face, following, twin = found.T
    is_there = origin >= 0
    assert is_there.sum() == (faces >= 0).sum()
    assert (found[~is_there][:, [0, 2, 3]] == -1).all()
    np.testing.assert_array_equal(face, np.arange(len(face)) // 4)
    np.testing.assert_array_equal(origin[twin[is_there]], origin[following[is_there]])
    np.testing.assert_array_equal(face[following[is_there]], face[is_there])
