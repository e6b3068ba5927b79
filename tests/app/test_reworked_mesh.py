"""What is done to a mesh of a file leaves what else the file has."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from dmc_cli.app.reworked_mesh import Reworked, _file_of, _grouped, work_on_mesh
from dmc_cli.mesh_io import MeshFile
from dmc_cli.progress import SILENT, Stopwatch
from dmc_cli.runtime import select_device
from dmc_cli.settings import MeshSettings, ReworkSettings
from tests import shapes


def worked(mesh, **operations):
    settings = ReworkSettings(mesh="a.obj", path="b.obj", operations=MeshSettings(**operations))
    work = Reworked(mesh, {}, None, {}, {}, [])
    work_on_mesh(settings, work, select_device("cpu", 1), Stopwatch(SILENT))
    return work.mesh


@pytest.fixture
def two():
    """Two tori side by side, whose quads have numbers."""
    points, quads = shapes.joined(shapes.torus(16, 12), shapes.moved(shapes.torus(16, 12), (9, 0, 0)))
    return MeshFile(
        points=np.float32(points),
        faces=quads,
        unit="um",
        space="RAS",
        face_values={"number": np.arange(len(quads), dtype=np.int32)},
        vertex_values={"number": np.arange(len(points), dtype=np.int32)},
        groups={"left": len(quads) // 2, "empty": 0, "right": len(quads) // 2},
        colors={"right": (255, 0, 0)},
    )


def test_groups_colours_values_and_units_stay(two):
    found = worked(two, quads="40%")
    assert len(found.faces) == round(0.4 * len(two.faces))
    assert list(found.groups) == ["left", "right"]
    assert sum(found.groups.values()) == len(found.faces)
    left, right = np.split(found.points[found.faces][..., 0], [found.groups["left"]])
    assert left.max() < 4.5 < right.min()
    assert (found.colors, found.unit, found.space) == (two.colors, "um", "RAS")
    number, of_vertex = found.face_values["number"], found.vertex_values["number"]
    assert len(np.unique(number)) == len(found.faces)
    assert (np.diff(number) > 0).all()
    assert len(np.unique(of_vertex)) == len(found.points)


def test_faces_that_a_stage_puts_elsewhere_go_back_to_their_groups(two):
    mesh = _grouped(two, select_device("cpu", 1))
    order = np.random.default_rng(0).permutation(len(two.faces))
    values = {name: wp.array(found.numpy()[order], device="cpu") for name, found in mesh.face_values.items()}
    faces = wp.array(two.faces[order], dtype=wp.vec4i, device="cpu")
    found = _file_of(replace(mesh, faces=faces, face_values=values), None, two)
    half = len(two.faces) // 2
    assert found.groups == {"left": half, "right": half}
    assert np.array_equal(np.sort(found.face_values["number"][:half]), np.arange(half))
    assert np.array_equal(found.faces, two.faces[found.face_values["number"]])
