"""The cube, byte for byte: a change of any writer shows here first."""

import dataclasses
import hashlib
import struct

import numpy as np
import pytest

from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.write import write_mesh
from dmc_cli.notices import Notice

VERTICES = [f"{x}.0 {y}.0 {z}.0" for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
NORMALS = [" ".join("-0.57735026" if "-" in x else "0.57735026" for x in v.split()) for v in VERTICES]
QUADS = ["0 2 3 1", "4 5 7 6", "0 1 5 4", "2 6 7 3", "0 4 6 2", "1 3 7 5"]
PLY_HEADER = """ply
format {} 1.0
comment written by dmc
comment SPACE=RAS
element vertex 8
property float x
property float y
property float z
property float nx
property float ny
property float nz
element face 6
property list uchar int vertex_indices
end_header
"""


def written(tmp_path, mesh, name, **options):
    write_mesh(str(tmp_path / name), mesh, **options)
    return (tmp_path / name).read_bytes()


def test_ply_is_binary_little_endian(tmp_path, cube):
    data = written(tmp_path, cube, "cube.ply")
    body = np.hstack((cube.points, cube.normals)).astype("<f4").tobytes()
    body += b"".join(struct.pack("<B4i", 4, *map(int, quad.split())) for quad in QUADS)
    assert data == PLY_HEADER.format("binary_little_endian").encode() + body


def test_ply_in_ascii(tmp_path, cube):
    data = written(tmp_path, cube, "cube.ply", ascii=True)
    rows = [f"{v} {n}" for v, n in zip(VERTICES, NORMALS, strict=True)] + [f"4 {q}" for q in QUADS]
    assert data.decode() == PLY_HEADER.format("ascii") + "\n".join(rows) + "\n"


def test_obj_counts_from_one_and_gives_each_vertex_its_normal(tmp_path, cube):
    faces = [" ".join(f"{int(c) + 1}//{int(c) + 1}" for c in quad.split()) for quad in QUADS]
    lines = ["# written by dmc", "# SPACE=RAS"]
    lines += [f"v {v}" for v in VERTICES] + [f"vn {n}" for n in NORMALS] + [f"f {f}" for f in faces]
    assert written(tmp_path, cube, "cube.obj").decode() == "\n".join(lines) + "\n"


def test_obj_without_normals(tmp_path, cube):
    bare = dataclasses.replace(cube, normals=None, space="none")
    faces = [" ".join(str(int(c) + 1) for c in quad.split()) for quad in QUADS]
    lines = ["# written by dmc"] + [f"v {v}" for v in VERTICES] + [f"f {f}" for f in faces]
    assert written(tmp_path, bare, "cube.obj").decode() == "\n".join(lines) + "\n"


def test_off_says_how_many_and_counts_from_zero(tmp_path, cube):
    lines = ["OFF", "8 6 0", *VERTICES, *[f"4 {quad}" for quad in QUADS]]
    assert written(tmp_path, cube, "cube.off").decode() == "\n".join(lines) + "\n"


def test_off_reports_that_normals_are_left_out(tmp_path, cube):
    result = write_mesh(str(tmp_path / "cube.off"), cube)
    assert result.warnings == (Notice("W-NORMALS-LEFT-OUT", "OFF files hold no normals: they were left out"),)
    assert write_mesh(str(tmp_path / "cube.obj"), cube).warnings == ()


@pytest.mark.parametrize("name", ["none.ply", "none.obj", "none.off"])
def test_an_empty_mesh_is_a_valid_file(tmp_path, name):
    empty = MeshFile(points=np.zeros((0, 3), np.float32), faces=np.zeros((0, 4), np.int32))
    data = written(tmp_path, empty, name)
    assert data.startswith({"ply": b"ply\n", "obj": b"# written", "off": b"OFF\n0 0 0\n"}[name[-3:]])


@pytest.mark.parametrize("name", ["grid.ply", "grid.obj", "grid.off"])
def test_the_size_in_the_result_is_the_size_of_the_file(tmp_path, grid, name):
    result = write_mesh(str(tmp_path / name), grid)
    assert result.size == (tmp_path / name).stat().st_size


@pytest.mark.parametrize(
    ("name", "ascii"), [("a.ply", False), ("a.ply", True), ("a.obj", False), ("a.off", False)]
)
def test_chunks_do_not_show(tmp_path, grid, monkeypatch, name, ascii):
    whole = written(tmp_path, grid, name, ascii=ascii)
    monkeypatch.setattr("dmc_cli.mesh_io.text.CHUNK_ROWS", 97)
    assert written(tmp_path, grid, name, ascii=ascii, force=True) == whole


HASHES: dict[str, str] = {
    "cube.stl": "5eec0e1a15623bb3",
    "cube.ascii.stl": "96ee2a87a986676b",
    "cube.vtp": "07cfc9a92ea57467",
    "cube.ascii.vtp": "c6046489b4a3deea",
    "cube.vtu": "9ed8a67f55410ead",
    "cube.ascii.vtu": "b13cb699b61affee",
    "cube.vtk": "d76a575184674187",
    "cube.ascii.vtk": "37a2387d56780739",
    "cube.glb": "cc4d8d53ad831a20",
    "cube.msh": "088e665f44af2d29",
    "cube.ascii.msh": "e38a2683008cd155",
    "cube.inp": "657dc3723bf0cb81",
    "cube.nas": "2043959c813322d9",
    "cube.k": "70a774299242ed9c",
    "cube.mesh": "d13d7d1b4e36ed00",
    "cube.xdmf": "573fc669c2ffb344",
    "cube.gii": "d7030c8c9de4b8cc",
    "cube.ascii.gii": "05f3636097b74579",
    "cube.pial": "50d0d50722dc34b2",
    "cube.usda": "aafd01fc39e10eaf",
}
"""Of the cube with a value a vertex and two a face, by the name of its file."""


@pytest.mark.parametrize("name", HASHES)
def test_the_bytes_of_the_cube_are_as_they_were(tmp_path, cube, name):
    """Whoever changes a writer on purpose looks at the file, and writes its hash down anew."""
    values = {"vertex_values": {"a": cube.points[:, 0]}, "face_values": {"labels": cube.faces[:, :2].copy()}}
    data = written(tmp_path, dataclasses.replace(cube, **values), name, ascii="ascii" in name)
    assert hashlib.sha256(data).hexdigest()[:16] == HASHES[name]


def test_every_format_has_its_bytes_held():
    known = {name.rpartition(".")[2] for name in HASHES} | {"ply", "obj", "off"}
    assert known | {"3mf"} == {each.suffix[1:] for each in FORMATS.values()}  # 3MF follows zlib's version
