"""Colours are the oracle's, proper across every twin, and the same on any device and number of threads."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given

from dmc_cli.contouring.vertex_colors import color_vertices
from dmc_cli.mesh.halfedges import NO_TWIN
from dmc_cli.mesh.mesh import COLOR, COLOR24
from dmc_cli.processing.color_repair import choose_colors_kernel, repair_colors
from dmc_cli.runtime.device import Device
from dmc_cli.settings import SurfaceSettings
from tests import shapes
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import one_inside_node, paper_field, white_noise
from tests.mesh.hand_made import working
from tests.mesh.meshes import colored
from tests.oracle.coloring import grid_color, reduce_colors as reduce_by_oracle
from tests.oracle.surface import extract_oracle_surface
from tests.strategies import volumes_with_settings


def assert_proper(color, twin):
    color, twin = np.repeat(color, 4), np.asarray(twin)
    with_twin = twin != NO_TWIN
    assert (color[with_twin] != color[twin[with_twin]]).all()


@given(volumes_with_settings())
def test_the_colors_of_any_volume_are_the_oracles(volume_and_settings):
    volume, settings = volume_and_settings
    mesh = colored(extract_on("cpu", volume, settings))
    oracle = extract_oracle_surface(volume, settings)
    expected = np.array([grid_color(edge) for edge, _ in oracle.quads], dtype=np.uint8)
    np.testing.assert_array_equal(mesh.mesh.face_values[COLOR24].numpy(), expected)
    twin = mesh.mesh.halfedges.twin.numpy()
    np.testing.assert_array_equal(mesh.mesh.face_values[COLOR].numpy(), reduce_by_oracle(expected, twin))
    assert_proper(expected, twin)
    assert_proper(mesh.mesh.face_values[COLOR].numpy(), twin)


def test_genus_two_ends_with_the_colors_of_the_notes(extract):
    surface = extract(paper_field("genus_two", 256), topology="asymptotic", threads=2)
    counts = np.bincount(colored(surface).mesh.face_values[COLOR].numpy())
    assert counts.tolist() == [62198, 53391, 31935, 10985, 395]


@pytest.mark.parametrize("border", ["open", "closed"])
def test_threads_do_not_show(extract, border):
    one, four = (colored(extract(white_noise(40), border=border, threads=threads)) for threads in (1, 4))
    np.testing.assert_array_equal(one.mesh.face_values[COLOR].numpy(), four.mesh.face_values[COLOR].numpy())
    np.testing.assert_array_equal(
        one.mesh.face_values[COLOR24].numpy(), four.mesh.face_values[COLOR24].numpy()
    )


def test_the_vertices_of_a_box_have_the_eight_colors(extract):
    colors = color_vertices(extract(one_inside_node()).placement).numpy()
    assert sorted(colors.tolist()) == list(range(8))


def test_neighboring_vertices_have_different_colors(extract):
    surface = extract(white_noise(16))
    colors, quads = color_vertices(surface.placement).numpy(), surface.mesh.faces.numpy()
    assert (colors[quads] != colors[np.roll(quads, -1, axis=1)]).all()


def test_repair_makes_any_coloring_proper(device):
    mesh = colored(extract_on(device, white_noise(16), SurfaceSettings(isovalue=0.0), threads=2))
    twin, color = mesh.mesh.halfedges.twin, mesh.mesh.face_values[COLOR]
    color.zero_()
    seams = wp.array(np.arange(twin.shape[0], dtype=np.int32), device=device)
    repair_colors(mesh.mesh.device, twin, color, seams)
    assert color.numpy().max() < 5
    assert_proper(color.numpy(), twin.numpy())


def repaired(shape, color, gone=(), seams=None):
    """The colours of a hand-made mesh after repair."""
    mesh = working(shape)
    colors = wp.array(np.array(color, dtype=np.uint8), dtype=wp.uint8)
    halfedges = np.arange(4 * mesh.face_count) if seams is None else seams
    mesh.arrays.face_gone.numpy()[list(gone)] = 1
    listed = wp.array(np.array(halfedges, dtype=np.int32), dtype=wp.int32)
    repair_colors(mesh.device, mesh.arrays.twin, colors, listed, gone=mesh.arrays.face_gone)
    return colors.numpy().tolist()


def test_of_two_in_a_clash_the_lower_key_takes_another_color_and_the_other_keeps_its_own():
    keys = [q * 2654435769 % 2**32 for q in range(4)]
    assert keys[0] < keys[2] < keys[1] < keys[3]
    pair, four = shapes.open_strip(2), shapes.open_strip(4)
    assert repaired(pair, [0, 0]) == [1, 0]
    assert repaired(pair, [3, 3]) == [0, 3]
    points, quads = pair
    assert repaired((points, np.stack([np.roll(quads[0], -1), quads[1]])), [0, 0]) == [1, 0], (
        "across halfedge 0"
    )
    # 0 and 2 wait for nobody; then no quad is left in a clash
    assert repaired(four, [0, 0, 0, 0]) == [1, 0, 1, 0]
    assert repaired(four, [2, 1, 1, 2]) == [2, 1, 0, 2]
    assert repaired(four, [0, 1, 1, 0]) == [0, 1, 2, 0], "the lowest colour that no neighbour has"


def test_nothing_lies_across_a_side_without_a_twin():
    """Index -1 is the last quad, as Warp has it: here in a clash with 1, which its open sides do not show."""
    twin = np.full(16, NO_TWIN)
    twin[[5, 14]] = 14, 5
    colors = wp.array([0, 1, 2, 1], dtype=wp.uint8)
    chosen, waits = wp.zeros(2, dtype=wp.int32), wp.zeros(2, dtype=wp.int64)
    inputs = [wp.array(twin, dtype=wp.int32), colors, wp.array([1, 3], dtype=wp.int32)]
    Device("cpu").launch(choose_colors_kernel, 2, inputs, [chosen, waits])
    assert chosen.numpy().tolist() == [0, -1]
    assert waits.numpy().tolist() == [0, 1]


def test_a_side_without_a_twin_takes_no_color():
    apart = shapes.open_strip(4)
    assert repaired(apart, [1, 1, 2, 0]) == [0, 1, 2, 0], "the last quad's colour is free"
    assert repaired(apart, [0, 1, 2, 0]) == [0, 1, 2, 0], "the last quad has the first one's color"


def test_only_the_quads_that_are_there_and_the_listed_sides_are_looked_at():
    pair = shapes.open_strip(2)
    assert repaired(pair, [0, 0], gone=[0, 1]) == [0, 0]
    assert repaired(pair, [0, 0], seams=[-1, 0, 2, 3]) == [0, 0]
    assert repaired(pair, [0, 0], seams=[-1, 1]) == [1, 0]
    assert repaired(pair, [0, 1]) == [0, 1]


def test_the_fifth_color_is_taken_where_the_neighbors_have_four():
    assert repaired(shapes.grid(3, 3), [4, 0, 4, 1, 0, 2, 4, 3, 4]) == [4, 0, 4, 1, 4, 2, 4, 3, 4]
