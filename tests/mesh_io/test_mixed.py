"""Meshes of quads and triangles: what is written is what a plain writer writes, and is read again."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from dmc_cli.notices import Notice
from tests.mesh_io.layouts import EXACT, LAYOUTS, rings
from tests.mesh_io.mixed import mixed_meshes


def plain_faces(mesh, name, ascii):
    """The faces of a file, one after the other."""
    if name == "ply" and not ascii:
        return b"".join(struct.pack(f"<B{len(ring)}i", len(ring), *ring) for ring in rings(mesh.faces))
    if name == "obj":
        word = "{0}" if mesh.normals is None else "{0}//{0}"
        lines = [" ".join(["f", *(word.format(v + 1) for v in ring)]) for ring in rings(mesh.faces)]
    else:
        lines = [" ".join(map(str, [len(ring), *ring])) for ring in rings(mesh.faces)]
    return "".join(f"{line}\n" for line in lines).encode()


@pytest.mark.parametrize(("name", "ascii"), EXACT)
@given(mesh=mixed_meshes())
def test_faces_of_three_and_four_corners_stand_in_their_order(tmp_path_factory, name, ascii, mesh):
    path = tmp_path_factory.mktemp("mixed") / f"mesh{FORMATS[name].suffix}"
    write_mesh(str(path), mesh, ascii=ascii)
    if name in ("ply", "obj", "off"):
        assert path.read_bytes().endswith(b"\n" * (name != "ply" or ascii) + plain_faces(mesh, name, ascii))
    found = read_mesh(path)
    np.testing.assert_array_equal(found.points.astype(np.float32), mesh.points.astype(np.float32))
    np.testing.assert_array_equal(found.faces, mesh.faces)
    assert (found.triangle_count, found.quad_count) == (mesh.triangle_count, mesh.quad_count)
    assert found.space == ("none" if name == "off" else mesh.space)


@pytest.mark.parametrize(("name", "ascii"), LAYOUTS)
def test_chunks_of_a_mixed_mesh_do_not_show(tmp_path, grid, monkeypatch, name, ascii):
    faces = grid.faces.copy()
    faces[np.random.default_rng(0).random(len(faces)) < 0.3, 3] = -1
    faces[97:194, 3] = -1
    mixed = replace(grid, faces=faces, face_values={"row": np.arange(len(faces), dtype=np.int32)})
    path = tmp_path / f"mesh{FORMATS[name].suffix}"
    write_mesh(str(path), mixed, ascii=ascii)
    whole = path.read_bytes()
    monkeypatch.setattr("dmc_cli.mesh_io.text.CHUNK_ROWS", 97)
    write_mesh(str(path), mixed, ascii=ascii, force=True)
    assert path.read_bytes() == whole


@pytest.mark.parametrize(("name", "ascii"), LAYOUTS)
def test_doubles_are_written_as_the_nearest_float32(tmp_path, cube, name, ascii):
    points = cube.points.astype(np.float64) + 1 / 3
    paths = [tmp_path / f"{kind}{FORMATS[name].suffix}" for kind in ("single", "double")]
    for path, dtype in zip(paths, (np.float32, np.float64), strict=True):
        write_mesh(str(path), replace(cube, points=points.astype(dtype)), ascii=ascii)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("name", [name for name in FORMATS if not FORMATS[name].holds_face_values])
def test_values_that_a_format_cannot_hold_are_told(tmp_path, cube, name):
    values = {"vertex_values": {"label": np.zeros(8)}, "face_values": {"labels": np.zeros((6, 2), np.int32)}}
    written = write_mesh(str(tmp_path / f"a{FORMATS[name].suffix}"), replace(cube, normals=None, **values))
    left = "of faces; left out: labels"
    if not FORMATS[name].holds_vertex_values:
        left = "of vertices and faces; left out: label, labels"
    told = Notice("W-VALUES-LEFT-OUT", f"{FORMATS[name].title} files hold no values {left}")
    assert [notice for notice in written.warnings if notice.code != "W-QUADS-SPLIT"] == [told]
