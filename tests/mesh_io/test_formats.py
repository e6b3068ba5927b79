"""The registry of formats of meshes: every one is written and read."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.errors import MeshFileError, SettingsError
from dmc_cli.mesh_formats import FORMATS, function, known_suffixes
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from dmc_cli.volume import UNIT_LENGTHS
from tests.mesh_io.layouts import LAYOUTS, rings, turned


@pytest.mark.parametrize("name", FORMATS)
def test_what_is_written_is_read_again(name, cube, tmp_path):
    path = str(tmp_path / f"a{FORMATS[name].suffix}")
    assert write_mesh(path, cube).format == name
    found = read_mesh(path)
    if FORMATS[name].holds_quads:
        np.testing.assert_array_equal(found.points, cube.points)
        assert [turned(ring) for ring in rings(found.faces)] == [turned(ring) for ring in rings(cube.faces)]
        return
    corners = [{tuple(found.points[v]) for v in ring} for ring in rings(found.faces)]
    squares = [{tuple(cube.points[v]) for v in ring} for ring in rings(cube.faces)]
    for square, first, second in zip(squares, corners[::2], corners[1::2], strict=True):
        assert (first | second, len(first), len(second)) == (square, 3, 3)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("unit", ["um", "nm", "m"])
def test_places_are_the_same_whatever_the_unit(name, unit, cube, tmp_path):
    path = str(tmp_path / f"a{FORMATS[name].suffix}")
    if FORMATS[name].is_ras_mm:
        with pytest.raises(
            SettingsError, match=f"{FORMATS[name].title} files are in millimetres; leave it out"
        ):
            write_mesh(path, replace(cube, unit=unit))
        return
    write_mesh(path, replace(cube, unit=unit))
    found = read_mesh(path)
    places = np.unique(np.abs(found.points)) * UNIT_LENGTHS[found.unit]
    np.testing.assert_allclose(places, UNIT_LENGTHS[unit], rtol=1e-6)


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "off"])
@pytest.mark.parametrize("space", ["RAS", "LPS", "none"])
def test_the_space_is_told(name, space, cube, tmp_path):
    path = str(tmp_path / f"a{FORMATS[name].suffix}")
    told = write_mesh(path, replace(cube, space=space)).warnings
    found, is_turned = read_mesh(path), FORMATS[name].is_ras_mm and space == "LPS"
    assert found.space == ("RAS" if is_turned else space)
    assert ("W-SPACE-TURNED" in [notice.code for notice in told]) == is_turned
    if FORMATS[name].holds_quads:
        return
    turned_points = cube.points * ((-1, -1, 1) if is_turned else (1, 1, 1))
    assert sorted(map(tuple, found.points)) == sorted(map(tuple, turned_points))
    assert signed_volume(found) == pytest.approx(8)


def signed_volume(mesh):
    """Of triangles that look outward: positive."""
    return np.linalg.det(mesh.points[mesh.faces[:, :3]]).sum() / 6


@pytest.mark.parametrize("name", [name for name in FORMATS if FORMATS[name].encoding == "binary"])
def test_text_of_a_binary_format_is_refused(name, cube, tmp_path):
    path = tmp_path / f"a{FORMATS[name].suffix}"
    with pytest.raises(
        SettingsError, match=f"{FORMATS[name].title} files are binary; expected one of ply, obj"
    ):
        write_mesh(str(path), cube, ascii=True)
    assert not path.exists()


@pytest.mark.parametrize(("name", "ascii"), LAYOUTS)
def test_chunks_and_runs_do_not_show(name, ascii, grid, tmp_path, monkeypatch):
    faces = grid.faces.copy()
    faces[::5, 3] = -1
    values = {
        "vertex_values": {"a": grid.points[:, 0].copy()},
        "face_values": {"labels": faces[:, :2].copy()},
    }
    mesh = replace(grid, faces=faces, **values)
    encode = function(FORMATS[name].encode)
    whole = b"".join(encode(mesh, ascii=ascii))
    assert b"".join(encode(mesh, ascii=ascii)) == whole
    monkeypatch.setattr("dmc_cli.mesh_io.text.CHUNK_ROWS", 97)
    pieces = list(encode(mesh, ascii=ascii))
    assert len(pieces) > 100
    if name == "3mf":  # zlib sees the ends of pieces
        assert unzipped(b"".join(pieces)) == unzipped(whole)
    else:
        assert b"".join(pieces) == whole


def unzipped(data):
    """The files of a zip by name."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {entry.filename: (entry.date_time, archive.read(entry)) for entry in archive.infolist()}


@pytest.mark.parametrize(("name", "ascii"), LAYOUTS)
def test_an_empty_mesh_is_written(name, ascii, tmp_path):
    empty = MeshFile(points=np.zeros((0, 3), np.float32), faces=np.zeros((0, 4), np.int32))
    path = tmp_path / f"a{FORMATS[name].suffix}"
    assert write_mesh(str(path), empty, ascii=ascii).size == path.stat().st_size > 0
    with pytest.raises(MeshFileError, match=r"no faces were found|(meshio|nibabel) cannot read it"):
        read_mesh(path)


def test_no_suffix_means_two_formats():
    assert len(known_suffixes()) == len(set(known_suffixes()))
