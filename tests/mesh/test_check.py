"""`--check` accepts a good mesh and names what is wrong with any other, whatever it is."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from dmc_cli.contouring import compute_normals, connect_faces
from dmc_cli.errors import MeshInvariantError
from dmc_cli.mesh.check import DEVIATION_TOLERANCE, UNIT_TOLERANCE, check_mesh
from dmc_cli.mesh.connectivity import connect
from dmc_cli.mesh.halfedges import Halfedges
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import one_cell, sphere

SOUND = {"non_manifold_edges": 0, "non_manifold_vertices": 0}


class Finished:
    """A finished mesh that can be spoilt, and the settings that it was made by."""

    def __init__(self, volume, **surface):
        chosen = SurfaceSettings(isovalue=0.0, **surface)
        surface = connect_faces(extract_on("cpu", volume, chosen))
        self.mesh, self.placement = surface.mesh, surface.placement
        self.normals = None
        self.report = {"deviation": {"max_relative": 0.0}, "topology": dict(SOUND)}
        self.settings = ConvertSettings(input="a", surface=chosen, output=OutputSettings(path="a.ply"))

    def check(self):
        check_mesh(self.mesh, self.placement, self.normals, self.report, self.settings)

    def refused(self, message):
        with pytest.raises(MeshInvariantError, match=f"{message}.*; please report this"):
            self.check()

    def cut(self, quads, vertices, twin, vertex_halfedge):
        """Take other quads, of as many of the vertices."""
        found = [wp.array(np.asarray(a, np.int32), dtype=wp.int32) for a in (twin, vertex_halfedge)]
        self.mesh = replace(
            self.mesh,
            faces=wp.array(quads, dtype=wp.vec4i),
            positions=wp.array(self.mesh.positions.numpy()[:vertices], dtype=wp.vec3),
            halfedges=Halfedges(*found, self.mesh.halfedges.valence[:vertices]),
            face_values={},
        )
        self.placement = replace(
            self.placement,
            local=wp.array(self.placement.local.numpy()[:vertices], dtype=wp.vec3),
            cell=wp.array(self.placement.cell.numpy()[:vertices], dtype=wp.int64),
        )

    def with_mesh(self, **settings):
        self.settings = replace(self.settings, mesh=MeshSettings(**settings))
        return self


@pytest.fixture
def ball():
    return Finished(sphere(8))


def test_a_good_mesh_is_accepted(ball):
    ball.check()
    ball.normals = wp.array(np.tile([0.0, 0.6, 0.8], (ball.mesh.vertex_count, 1)), dtype=wp.vec3)
    ball.check()


def test_the_programs_own_normals_are_accepted(ball):
    ball.normals = compute_normals(ball.placement, ball.settings.surface)
    ball.check()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", range(3))
def test_a_vertex_that_is_not_finite_is_named(ball, bad, axis):
    ball.mesh.positions.numpy()[5, axis] = bad
    ball.refused("vertex 5 is not finite")


@pytest.mark.parametrize(("bad", "is_good"), [(-0.001, False), (1.001, False), (0.0, True), (1.0, True)])
@pytest.mark.parametrize("axis", range(3))
def test_a_vertex_outside_its_cell_is_named(ball, bad, is_good, axis):
    ball.placement.local.numpy()[7, axis] = bad
    if is_good:
        ball.check()
    else:
        ball.refused("vertex 7 lies outside its cell")


def test_a_quad_with_a_vertex_twice_is_named(ball):
    """The halfedges of such a quad are wrong as well, but looked at first."""
    quads = ball.mesh.faces.numpy()
    quads[3, 2] = quads[3, 0]
    ball.refused("halfedge|face 3 has a vertex twice")


def test_a_folded_quad_is_named():
    """Two quads back to back on three vertices: the halfedges are those of a mesh, the quads are none."""
    ball = Finished(sphere(8))
    quads, vertices = np.array([[0, 1, 0, 2], [0, 2, 0, 1]], dtype=np.int32), 3
    ball.cut(quads, vertices, [7, 6, 5, 4, 3, 2, 1, 0], [0, 1, 3])
    ball.settings = replace(
        ball.settings, surface=SurfaceSettings(isovalue=0.0, topology="asymptotic", border="open")
    )
    ball.refused("face 0 has a vertex twice")


def test_a_vertex_without_quads_is_named(ball):
    """Its halfedge has to start somewhere else, so the halfedges have one vertex less here."""
    last = ball.mesh.vertex_count
    object.__setattr__(ball.mesh, "positions", wp.array(np.zeros((last + 1, 3)), dtype=wp.vec3))
    ball.refused(f"vertex {last} is in no face")


def test_a_quad_with_a_vertex_that_is_not_there_is_named(ball):
    quads, last = ball.mesh.faces.numpy(), ball.mesh.vertex_count - 1
    object.__setattr__(ball.mesh, "positions", wp.array(np.zeros((last, 3)), dtype=wp.vec3))
    ball.refused(f"face {np.flatnonzero((quads == last).any(axis=1))[0]} names a vertex that is not there")


@pytest.mark.parametrize(
    ("length", "is_good"),
    [(1 + 0.9e-4, True), (1 - 0.9e-4, True), (1.0002, False), (0.9998, False), (0.0, False)],
)
def test_a_normal_of_another_length_is_named(ball, length, is_good):
    assert UNIT_TOLERANCE == 1e-4
    normals = np.tile([0.0, 0.0, 1.0], (ball.mesh.vertex_count, 1))
    normals[9] *= length
    ball.normals = wp.array(normals, dtype=wp.vec3)
    if is_good:
        ball.check()
    else:
        ball.refused("the normal of vertex 9 has not length 1")


def test_a_vertex_off_the_surface_is_told_of(ball):
    assert DEVIATION_TOLERANCE == 1e-5
    ball.report["deviation"]["max_relative"] = 1e-5
    ball.check()
    ball.report["deviation"]["max_relative"] = 1.1e-5
    ball.refused("a vertex deviates by 1.1e-05 of the value range")


@pytest.mark.parametrize("unknown", [None, {"max_relative": None}])
def test_a_deviation_that_is_not_known_is_no_fault(ball, unknown):
    ball.report["deviation"] = unknown
    ball.check()


@pytest.mark.parametrize(
    ("mesh", "is_exact"),
    [
        ({"simplify": "none"}, True),
        ({"simplify": "all"}, True),
        ({"simplify": "none", "project": False}, True),
        ({"simplify": "3333", "project": False}, True),
        ({"simplify": "3x3y", "project": False}, False),
        ({"simplify": "all", "project": False}, False),
    ],
)
def test_vertices_must_be_on_the_surface_only_where_they_were_put_there(ball, mesh, is_exact):
    ball.with_mesh(**mesh).report["deviation"]["max_relative"] = 0.1
    if is_exact:
        ball.refused("a vertex deviates by 0.1")
    else:
        ball.check()


def test_other_placements_are_off_the_surface():
    ball = Finished(sphere(8), placement="centroid")
    ball.report["deviation"]["max_relative"] = 0.1
    ball.check()


@pytest.mark.parametrize("key", SOUND)
def test_a_manifold_that_is_none_is_told_of(ball, key):
    ball.report["topology"][key] = 2
    ball.refused(f"2 {key.replace('_', ' ')} were found; expected none")
    ball.settings = replace(
        ball.settings, surface=SurfaceSettings(isovalue=0.0, topology="asymptotic", border="closed")
    )
    ball.check()


def test_of_the_papers_bare_rules_only_halfedges_are_checked(ball):
    ball.with_mesh(simplify="all", simplify_rules="paper")
    ball.mesh.positions.numpy()[0] = np.nan
    ball.check()
    ball.mesh.halfedges.twin.numpy()[0] = 0
    ball.refused("halfedge 0 is its own twin")
    ball.with_mesh(simplify="none", simplify_rules="paper")
    ball.mesh = connect(replace(ball.mesh, halfedges=None))
    ball.refused("vertex 0 is not finite")


@pytest.mark.parametrize(
    ("topology", "border", "is_refused"),
    [("manifold", "open", True), ("asymptotic", "closed", True), ("asymptotic", "open", False)],
)
def test_two_fans_at_a_vertex_are_only_where_they_may_be(topology, border, is_refused):
    ball = Finished(sphere(8))
    quads = np.array([[0, 1, 2, 3], [0, 4, 5, 6]], dtype=np.int32)
    ball.cut(quads, 7, np.full(8, -1), [0, 1, 2, 3, 5, 6, 7])
    ball.settings = replace(
        ball.settings, surface=SurfaceSettings(isovalue=0.0, topology=topology, border=border)
    )
    if is_refused:
        ball.refused("vertex 0 has 2 fans")
    else:
        ball.check()


def test_an_empty_mesh_is_accepted():
    Finished(one_cell(0)).check()
