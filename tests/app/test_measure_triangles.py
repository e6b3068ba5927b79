"""`dmc measure` of triangle and mixed meshes whose topology is known, open and closed, from every format."""

import json
from collections import Counter

import numpy as np
import pytest
import trimesh

from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests import shapes
from tests.measures.meshes import plain_valences


def icosphere(depth=2):
    """A sphere of 20 * 4^depth triangles: twelve valences of five, all others six."""
    mesh = trimesh.creation.icosphere(depth)
    return mesh.vertices, np.column_stack([mesh.faces, np.full(len(mesh.faces), -1)]).astype(np.int32)


def cut(shape, seed=0):
    """The shape with half of its quads cut to two triangles along a diagonal."""
    points, quads = shape
    is_cut = np.random.default_rng(seed).random(len(quads)) < 0.5
    triangles = np.concatenate([quads[is_cut][:, corners] for corners in ([0, 1, 2], [0, 2, 3])])
    faces = np.vstack([quads[~is_cut], np.column_stack([triangles, np.full(len(triangles), -1)])])
    order = np.random.default_rng(seed + 1).permutation(len(faces))
    return points, faces[order].astype(np.int32)


def without(shape, *gone):
    """The shape without some faces."""
    return shape[0], np.delete(shape[1], gone, axis=0)


FIVE_POINTS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0], [1, 1, 1]])

CASES = {
    "tetrahedron": (shapes.tetrahedron(), {"genus": 0, "euler_characteristic": 2}),
    "open tetrahedron": (
        without(shapes.tetrahedron(), 2),
        {"genus": 0, "euler_characteristic": 1, "boundary_edges": 3, "boundary_loops": 1},
    ),
    "icosphere": (icosphere(), {"genus": 0, "euler_characteristic": 2}),
    "icosphere with two holes": (
        without(icosphere(), 0, 200),
        {"genus": 0, "euler_characteristic": 0, "boundary_edges": 6, "boundary_loops": 2},
    ),
    "two icospheres": (
        shapes.joined(icosphere(), shapes.moved(icosphere(1), (3, 0, 0))),
        {"components": 2, "euler_characteristic": 4},
    ),
    "house": (shapes.house(), {"genus": 0, "euler_characteristic": 2}),
    "open house": (
        without(shapes.house(), 0, 5),
        {"genus": 0, "euler_characteristic": 0, "boundary_edges": 7, "boundary_loops": 2},
    ),
    "mixed torus": (cut(shapes.torus(9, 7)), {"genus": 1, "euler_characteristic": 0}),
    "mixed sheet": (
        cut(shapes.grid(7, 5)),
        {"genus": 0, "euler_characteristic": 1, "boundary_edges": 24, "boundary_loops": 1},
    ),
    "two triangles at a vertex": (
        (FIVE_POINTS, np.array([[0, 1, 2, -1], [0, 3, 4, -1]], np.int32)),
        {"genus": None, "euler_characteristic": 1, "boundary_edges": 6, "non_manifold_vertices": 1},
    ),
    "three triangles at an edge": (
        (FIVE_POINTS, np.array([[0, 1, 2, -1], [1, 0, 3, -1], [0, 1, 4, -1]], np.int32)),
        {"genus": None, "non_manifold_edges": 1},
    ),
}
CLOSED = {
    "components": 1,
    "boundary_edges": 0,
    "boundary_loops": 0,
    "non_manifold_edges": 0,
    "non_manifold_vertices": 0,
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("mesh_format", FORMATS)
def test_topology_is_what_it_is_known_to_be(run, tmp_path, name, mesh_format):
    (points, faces), expected = CASES[name]
    path = tmp_path / f"mesh{FORMATS[mesh_format].suffix}"
    write_mesh(str(path), MeshFile(points=np.asarray(points, float), faces=faces))
    found = json.loads(run("measure", path, "--json").stdout)
    if not FORMATS[mesh_format].holds_quads:
        written = read_mesh(path)  # tests/mesh_io holds which triangles these are
        points, faces = written.points, written.faces
        whole = CASES[name][0][1]
        assert (len(faces), written.quad_count) == ((whole >= 0).sum() - 2 * len(whole), 0)
    triangles = int((faces[:, 3] < 0).sum())
    assert (found["mesh"]["triangles"], found["mesh"]["quads"]) == (triangles, len(faces) - triangles)
    topology = found["topology"]
    known = expected if None in expected.values() else CLOSED | expected
    assert {key: topology[key] for key in known} == known
    valences = Counter(plain_valences(faces, len(points)).tolist())
    assert topology["valence_histogram"] == {str(v): valences[v] for v in sorted(valences)}
    is_planar = name != "mixed torus"  # what its quads bound depends on their diagonals
    if is_planar and not topology["boundary_edges"] and topology["components"] == 1:
        rings = [[v for v in face if v >= 0] for face in faces.tolist()]
        fans = [(ring[0], ring[c], ring[c + 1]) for ring in rings for c in range(1, len(ring) - 1)]
        exact = sum(np.linalg.det(np.asarray(points, float)[list(fan)]) for fan in fans) / 6
        assert found["mesh"]["volume"] == pytest.approx(exact, rel=1e-5)
