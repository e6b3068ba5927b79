"""The public stages in a wrong order, and on other meshes than they are made for, say what to call first."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import dmc_cli as dmc
from tests import shapes
from tests.fields import sphere
from tests.mesh.meshes import on_device

DEVICE = dmc.select_device("cpu", 2)
SETTINGS = dmc.SurfaceSettings(isovalue=0.0, border="closed")
SAFE = dmc.MeshSettings(simplify="all")
PAPER = dmc.MeshSettings(simplify="all", simplify_rules="paper")


def extracted():
    return dmc.extract_surface(dmc.upload_volume(sphere(12), DEVICE), SETTINGS)


def triangles():
    """The surface's mesh with its quads cut in two: the vertices and their placement are the same."""
    surface = extracted()
    shape = shapes.halved((surface.mesh.positions.numpy(), surface.mesh.faces.numpy()))
    return on_device(shape, DEVICE), surface.placement


def in_file():
    return dmc.file_of_mesh(extracted().mesh)


def simplified_in_surface():
    """A surface whose mesh was replaced by a smaller one."""
    surface = dmc.connect_faces(extracted())
    result = dmc.simplify(surface.mesh, surface.placement, SAFE)
    return replace(surface, mesh=result.mesh, placement=result.placement)


def connected_by_vertices():
    surface = extracted()
    return replace(surface, mesh=dmc.connect(surface.mesh))


def stages(mesh, placement) -> dict[str, Callable[[], object]]:
    """Every public stage that takes a mesh."""
    return {
        "connect": lambda: dmc.connect(mesh),
        "measure_quality": lambda: dmc.measure_quality(mesh),
        "measure_topology": lambda: dmc.measure_topology(mesh),
        "measure_elements": lambda: dmc.measure_elements(mesh),
        "measure_curvature": lambda: dmc.measure_curvature(mesh),
        "measure_distance": lambda: dmc.measure_distance(mesh, on_device(shapes.cube(), DEVICE), 10.0),
        "find_intersections": lambda: dmc.find_intersections(mesh),
        "simplify": lambda: dmc.simplify(mesh, placement, SAFE),
        "remesh": lambda: dmc.remesh(mesh, placement, 1),
        "decimate": lambda: dmc.decimate(mesh, placement, 10),
        "relax": lambda: dmc.relax(mesh, placement, 1),
        "compute_normals": lambda: dmc.compute_normals(placement, SETTINGS),
        "file_of_mesh": lambda: dmc.file_of_mesh(mesh),
    }


NAMES = list(stages(None, None))
OPTIONS = {"simplify": "--simplify", "remesh": "--remesh", "decimate": "--quads", "relax": "--relax"}
"""The options of the stages that change a mesh, and take quads alone."""


@pytest.mark.parametrize("name", NAMES)
def test_a_mesh_that_is_neither_connected_nor_coloured_goes_through(name):
    surface = extracted()
    assert stages(surface.mesh, surface.placement)[name]() is not None


@pytest.mark.parametrize("name", NAMES)
def test_a_mesh_of_triangles_is_taken_or_refused_in_words(name):
    stage = stages(*triangles())[name]
    if name in OPTIONS:
        with pytest.raises(
            dmc.DmcError, match=f"{OPTIONS[name]} takes meshes of quads; .* faces are triangles"
        ):
            stage()
    else:
        assert stage() is not None


@pytest.mark.parametrize("name", [name for name in NAMES if name != "compute_normals"])
def test_a_file_or_a_surface_is_no_mesh(name):
    for found in (in_file(), extracted()):
        kind = type(found).__name__
        with pytest.raises(dmc.CallError, match=f"a {kind} was found; expected a Mesh; .*mesh_of_file"):
            stages(found, extracted().placement)[name]()


@pytest.mark.parametrize("name", list(OPTIONS))
def test_the_placement_of_another_mesh_is_refused(name):
    surface, other = dmc.connect_faces(extracted()), dmc.connect_faces(extracted())
    result = dmc.simplify(surface.mesh, surface.placement, SAFE)
    with pytest.raises(dmc.CallError, match=r"the placement has .* places; expected .* one stage returned"):
        stages(result.mesh, other.placement)[name]()
    with pytest.raises(dmc.CallError, match="a Surface was found; expected a Placement"):
        stages(other.mesh, other)[name]()


def test_the_papers_rules_ask_for_colours():
    surface = extracted()
    for mesh in (surface.mesh, dmc.connect_faces(surface).mesh):
        with pytest.raises(dmc.CallError, match=r"no colours of faces.* color_faces on the surface first"):
            dmc.simplify(mesh, surface.placement, PAPER)
    colored = dmc.color_faces(dmc.connect_faces(surface))
    assert sum(dmc.simplify(colored.mesh, colored.placement, PAPER).removed_3x3y) > 0


def test_3333_by_the_papers_rules_needs_no_colours():
    surface = extracted()
    settings = replace(PAPER, simplify="3333")
    assert dmc.simplify(surface.mesh, surface.placement, settings).mesh.face_count > 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: dmc.extract_surface(sphere(12), SETTINGS), "a Volume was found; .* call upload_volume"),
        (
            lambda: dmc.color_faces(extracted()),
            r"along its grid; call connect_faces\(surface\)",
        ),
        (
            lambda: dmc.color_faces(connected_by_vertices()),
            "along its grid; call connect_faces",
        ),
        (lambda: dmc.connect_faces(extracted().mesh), r"a Mesh was found; .* by connect\(mesh\)"),
        (lambda: dmc.color_faces(extracted().mesh), "a Mesh was found; expected the Surface"),
        (lambda: dmc.connect_faces(simplified_in_surface()), "before the mesh is changed"),
        (lambda: dmc.color_faces(simplified_in_surface()), "before the mesh is changed"),
        (lambda: dmc.mesh_of_file(extracted().mesh, DEVICE), "a Mesh was found; expected a MeshFile"),
        (lambda: dmc.write_mesh("a.ply", extracted().mesh), "a Mesh was found; .*file_of_mesh"),
        (lambda: dmc.compute_normals(extracted().mesh, SETTINGS), "a Mesh was found; expected a Placement"),
        (
            lambda: dmc.Mesh.require_halfedges(extracted().mesh),
            r"call connect\(mesh\) first",
        ),
    ],
)
def test_a_stage_that_comes_too_early_says_what_to_call_first(call, message):
    with pytest.raises(dmc.CallError, match=message):
        call()


def test_stages_may_be_called_twice():
    surface = dmc.connect_faces(dmc.connect_faces(extracted()))
    surface = dmc.color_faces(dmc.color_faces(surface))
    again = dmc.connect_faces(surface)
    twins = [found.mesh.halfedges.twin.numpy() for found in (surface, again)]
    np.testing.assert_array_equal(*twins)
