"""OBJ's materials: a file beside the mesh, both or none, as other programs read it."""

import sys
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.errors import SettingsError, WriteError
from dmc_cli.mesh_io.mesh_file import UNCOLORED, grouped
from dmc_cli.mesh_io.write import write_mesh
from dmc_cli.settings import ConvertSettings, OutputSettings, SurfaceSettings

RED, GREEN = (255, 16, 0), (0, 128, 64)


@pytest.fixture
def three(cube):
    """Three cubes side by side, the last one without a colour."""
    cubes = [replace(cube, points=cube.points + np.array([5 * n, 0, 0], np.float32)) for n in range(3)]
    return grouped(
        {"skull": replace(cubes[0], color=RED), "left lung": replace(cubes[1], color=GREEN), "c": cubes[2]}
    )


def materials(path):
    """Each material with its colour up to 255, as the text says."""
    words = [line.split() for line in Path(path).read_text().splitlines()]
    names = [row[1] for row in words if row[0] == "newmtl"]
    colors = [tuple(round(255 * float(word)) for word in row[1:]) for row in words if row[0] == "Kd"]
    return dict(zip(names, colors, strict=True))


def test_a_material_a_group_stands_beside_the_mesh(tmp_path, three):
    told = write_mesh(str(tmp_path / "a.obj"), three)
    assert (told.companion, told.warnings) == (str(tmp_path / "a.mtl"), ())
    assert materials(tmp_path / "a.mtl") == {"skull": RED, "left_lung": GREEN, "c": UNCOLORED}
    lines = (tmp_path / "a.obj").read_text().splitlines()
    assert [line for line in lines if line.startswith(("mtllib", "g ", "usemtl"))] == [
        "mtllib a.mtl",
        *("g skull", "usemtl skull", "g left lung", "usemtl left_lung", "g c", "usemtl c"),
    ]
    uses = [index for index, line in enumerate(lines) if line.startswith("usemtl")]
    assert [sum(line.startswith("f ") for line in lines[start : start + 7]) for start in uses] == [6, 6, 6]


def test_trimesh_reads_the_materials(tmp_path, three):
    write_mesh(str(tmp_path / "a.obj"), replace(three, normals=None))
    scene = trimesh.load(tmp_path / "a.obj", process=False, split_objects=True, group_material=True)
    found = {}
    for part in scene.geometry.values():
        color = tuple(np.round(part.visual.material.diffuse[:3]).astype(int).tolist())
        found[part.visual.material.name] = (color, float(part.vertices[:, 0].mean()), len(part.faces))
    assert found == {"skull": (RED, 0, 12), "left_lung": (GREEN, 5, 12), "c": (UNCOLORED, 10, 12)}


def test_one_colour_of_the_whole_mesh_is_one_material(tmp_path, cube):
    write_mesh(str(tmp_path / "a.obj"), replace(cube, color=RED))
    assert materials(tmp_path / "a.mtl") == {"mesh": RED}
    assert "g " not in (tmp_path / "a.obj").read_text()


def test_without_colours_there_is_no_file_beside(tmp_path, cube):
    told = write_mesh(str(tmp_path / "a.obj"), cube)
    assert (told.companion, [path.name for path in tmp_path.iterdir()]) == (None, ["a.obj"])


@pytest.mark.parametrize("taken", ["a.obj", "a.mtl"])
def test_neither_is_written_where_one_exists(tmp_path, three, taken):
    (tmp_path / taken).write_text("mine")
    with pytest.raises(WriteError, match=f"{taken} exists already"):
        write_mesh(str(tmp_path / "a.obj"), three)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(taken, "mine")]
    write_mesh(str(tmp_path / "a.obj"), three, force=True)
    assert len(materials(tmp_path / "a.mtl")) == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mtl", "a.obj"]


@pytest.mark.parametrize("broken", ["encode_obj", "encode_materials"])
def test_nothing_half_written_is_left(tmp_path, three, broken, monkeypatch):
    def breaks(mesh, **choices):
        yield b"half"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(f"dmc_cli.mesh_io.obj.{broken}", breaks)
    with pytest.raises((WriteError, OSError)):
        write_mesh(str(tmp_path / "a.obj"), three)
    assert not list(tmp_path.iterdir())


def test_a_companion_goes_again_if_the_mesh_cannot_get_its_name(tmp_path, three, monkeypatch):
    real = Path.replace

    def refuses(part, target):
        if Path(target).suffix == ".obj":
            raise PermissionError(13, "Permission denied")
        return real(part, target)

    monkeypatch.setattr(Path, "replace", refuses)
    with pytest.raises(WriteError, match="no permission"):
        write_mesh(str(tmp_path / "a.obj"), three)
    assert not list(tmp_path.iterdir())


def test_standard_output_has_no_place_for_materials_and_says_so(three, monkeypatch):
    stream = BytesIO()
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(buffer=stream))
    told = write_mesh("-", three, output_format="obj")
    assert [notice.code for notice in told.warnings] == ["W-MATERIALS-LEFT-OUT"]
    assert b"mtl" not in stream.getvalue()
    assert stream.getvalue().count(b"\nv ") == 24


def test_the_file_of_materials_is_no_other_output(tmp_path):
    output = OutputSettings(path=str(tmp_path / "a.obj"), report=str(tmp_path / "a.mtl"))
    item = ConvertSettings(input="synth:iwp:20", surface=SurfaceSettings(isovalue=0.0), output=output)
    with pytest.raises(SettingsError, match=r"a\.mtl is the file of materials and .*a\.mtl the report"):
        refuse_overlaps([item])
