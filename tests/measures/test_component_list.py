"""Components of a mesh are listed, largest first, with what each would measure as a mesh of its own."""

import json

import jsonschema
import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dmc_cli.measures import component_list, list_components, measure_quality
from dmc_cli.mesh import connect, mesh_of_file
from dmc_cli.mesh_io import MeshFile
from dmc_cli.runtime.device import select_device
from tests.fields import smooth_noise, white_noise
from tests.test_methods import SCHEMA


def pieces(mesh):
    """The faces of each component through twins, largest first, found by SciPy."""
    twin = connect(mesh).halfedges.twin.numpy()
    linked = np.flatnonzero(twin >= 0)
    count = mesh.face_count
    graph = coo_array((np.ones(len(linked)), (linked // 4, twin[linked] // 4)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    faces = [np.flatnonzero(label == n) for n in range(number)]
    return sorted(faces, key=lambda found: (-len(found), found[0])), twin.reshape(-1, 4)


@pytest.mark.parametrize("method", ["dmc", "mc", "nets"])
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("at_once", [1 << 15, 100])
def test_each_is_measured_as_a_mesh_of_its_own(extract, monkeypatch, method, border, at_once):
    monkeypatch.setattr(component_list, "FACES_AT_ONCE", at_once)
    mesh = extract(smooth_noise(18, sigma=1.0), method=method, border=border).mesh
    found, (expected, twins) = list_components(mesh), pieces(mesh)
    assert [one.faces for one in found] == [len(faces) for faces in expected]
    assert len(found) > 4
    corners = mesh.faces.numpy()
    for one, faces in zip(found, expected, strict=True):
        file = MeshFile(points=mesh.positions.numpy(), faces=corners[faces])
        quality = measure_quality(mesh_of_file(file, mesh.device))
        assert one.area == pytest.approx(quality.area, rel=1e-12)
        is_open = ((twins[faces] < 0) & (corners[faces] >= 0)).any()
        assert (one.volume is None) == is_open
        if one.volume is not None:
            assert one.volume == pytest.approx(quality.signed_volume, rel=1e-6, abs=1e-9)
        used = file.points[corners[faces][corners[faces] >= 0]]
        assert one.bounds == (tuple(used.min(axis=0).tolist()), tuple(used.max(axis=0).tolist()))


def test_only_so_many_are_listed(extract):
    mesh = extract(white_noise(24), method="mc", border="closed").mesh
    whole, few = list_components(mesh), list_components(mesh, 7)
    assert len(whole) > 20
    assert [(one.faces, one.bounds) for one in few] == [(one.faces, one.bounds) for one in whole[:7]]


def test_a_mesh_without_faces_has_none():
    nothing = MeshFile(points=np.zeros((0, 3), np.float32), faces=np.zeros((0, 4), np.int32))
    assert list_components(mesh_of_file(nothing, select_device("cpu"))) == []


@pytest.mark.parametrize("method", ["dmc", "tmc"])
def test_reports_hold_the_list(run, tmp_path, method):
    words = ["--method", method, "--border", "closed", "--report", tmp_path / "r.json"]
    assert run("convert", "synth:noise:12", tmp_path / "a.ply", "-i", 0.9, *words).exit_code == 0
    report = json.loads((tmp_path / "r.json").read_text())
    jsonschema.validate(report, SCHEMA)
    listed = report["components"]
    assert len(listed) == report["topology"]["components"] > 10
    assert sum(one["faces"] for one in listed) == report["mesh"]["quads"] + report["mesh"]["triangles"]
    assert sum(one["area"] for one in listed) == pytest.approx(report["mesh"]["area"], rel=1e-9)
    assert sum(one["volume"] for one in listed) == pytest.approx(report["mesh"]["volume"], rel=1e-6)
    measured = json.loads(run("measure", tmp_path / "a.ply", "--json").stdout)["components"]
    assert [one["faces"] for one in measured] == [one["faces"] for one in listed]
