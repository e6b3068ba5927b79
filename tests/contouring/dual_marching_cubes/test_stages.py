"""Stages hand on the right types, isovalues, maps, orientation of quads and forecasts of memory."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.bits.words import LANES
from dmc_cli.contouring import extract_surface
from dmc_cli.errors import MemoryBudgetError
from dmc_cli.field import upload_volume
from dmc_cli.field.field import make_field, stored_isovalue
from dmc_cli.field.grid import grid_affine, grid_of, is_mirrored
from dmc_cli.field.planes import block_count, make_plane, padding
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from tests.fields import one_inside_node, smooth_noise, volume_of, white_noise

DEVICE = select_device("cpu", 2)


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ((-(2**31), 2**31 - 1), "int32"),
        ((0, 2**31), "uint32"),
        ((0, 2**32 - 1), "uint32"),
        ((0, 2**32), "float64"),
        ((-1, 2**31), "float64"),
        ((-(2**31) - 1, 0), "float64"),
    ],
)
def test_wide_integers_become_the_first_type_that_holds_them(ends, expected):
    values = np.resize(np.array(ends, np.int64), (2, 2, 2))
    uploaded = upload_volume(volume_of(values), DEVICE)
    assert uploaded.dtype == expected
    np.testing.assert_array_equal(uploaded.values.numpy().reshape(2, 2, 2), values)


@pytest.mark.parametrize(
    ("dtype", "slope", "intercept", "isovalue", "expected"),
    [
        ("uint8", 1.0, 0.0, 5.0, 4.5),
        ("uint8", -1.0, 0.0, -5.0, 5.5),
        ("int16", 1.0, -1024.0, 150.0, 1173.5),
        ("int16", 2.0, 0.0, 5.0, 2.5),
        ("int64", 1.0, 0.0, 5.25, 5.25),
        ("float32", 1.0, 0.0, 5.0, 5.0),
        ("float32", 1.0, 0.0, 0.1, float(np.float32(0.1))),
        ("float64", 1.0, 0.0, 0.1, 0.1),
    ],
)
def test_the_level_that_is_cut(dtype, slope, intercept, isovalue, expected):
    volume = volume_of(np.zeros((2, 2, 2), dtype), slope=slope, intercept=intercept)
    assert stored_isovalue(volume, isovalue) == expected
    field = make_field(upload_volume(volume, DEVICE), SurfaceSettings(isovalue=isovalue))
    assert (field.isovalue, field.sign, field.has_nodata) == (expected, np.sign(slope), 0)


@pytest.mark.parametrize("seed", range(5))
def test_a_map_mirrors_if_its_determinant_is_negative(seed):
    affine = np.eye(4)
    affine[:3, :3] = np.random.default_rng(seed).standard_normal((3, 3))
    assert is_mirrored(affine) == (np.linalg.det(affine[:3, :3]) < 0)
    affine[:3, 0] *= -1
    assert is_mirrored(affine) == (np.linalg.det(affine[:3, :3]) < 0)


@pytest.mark.parametrize("border", [0, 1])
def test_the_grids_map_puts_the_volumes_first_node_where_it_was(border):
    affine = np.random.default_rng(1).standard_normal((4, 4))
    affine[3] = 0, 0, 0, 1
    grid = grid_of((4, 5, 6), border)
    assert (grid.nx, grid.ny, grid.nz) == (4 + 2 * border, 5 + 2 * border, 6 + 2 * border)
    found = grid_affine(affine, grid) @ [border, border, border, 1]
    np.testing.assert_allclose(found, [*affine[:3, 3], 1])


@pytest.mark.parametrize("nx", [31, 32, 33, 600])
@pytest.mark.parametrize("ny", [2, 40])
def test_zeros_lie_round_the_line_of_words(nx, ny):
    grid = grid_of((nx, ny, 3), 0)
    plane = make_plane(grid, DEVICE)
    plane.rows.fill_(wp.uint32(0xFFFFFFFF))
    words = -(-nx // 32)
    ahead = padding(grid)
    line = plane.line.numpy()[:, 0]
    assert ahead >= words * (ny + 1) + 1
    assert not line[:ahead].any()
    assert (line[ahead : ahead + 3 * ny * words] == 0xFFFFFFFF).all()
    assert not line[ahead + 3 * ny * words :].any()
    assert len(line) >= ahead + LANES * block_count(grid) + words * (ny + 1) + 1


@pytest.mark.parametrize("orientation", ["outward", "gradient"])
@pytest.mark.parametrize("inside", ["above", "below"])
@pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, 1), (-1, -1, -1)])
def test_quads_face_as_the_sense_says(extract, signs, inside, orientation):
    volume = volume_of(one_inside_node().values, affine=np.diag([*signs, 1.0]))
    surface = extract(volume, inside=inside, orientation=orientation)
    a, b, c, d = (surface.mesh.positions.numpy()[surface.mesh.faces.numpy()[:, n]] * signs for n in range(4))
    out_of_the_node = np.sum(np.cross(c - a, d - b) * ((a + b + c + d) / 4 - 2.0), axis=1)
    outwards = np.sign(out_of_the_node) * np.prod(signs)  # in the output space, against the gradient of F
    assert (outwards == (1 if (inside, orientation) == ("above", "outward") else -1)).all()
    assert surface.numbering.is_reversed == ((inside, orientation) != ("above", "outward")) ^ (
        np.prod(signs) < 0
    )
    assert set(-outwards) == {surface.placement.frame.sense}


def test_memory_is_asked_for_before_it_is_taken(extract):
    volume, asked = white_noise(9), []
    uploaded, settings = upload_volume(volume, DEVICE), SurfaceSettings(isovalue=0.0)
    surface = extract_surface(uploaded, settings, reserve=lambda *counts, **cells: asked.append(counts))
    assert asked[-1] == (surface.mesh.vertex_count, surface.mesh.face_count)
    assert asked[:-1] == [(surface.numbering.cells.ordinary_count, surface.mesh.face_count)]

    def refuse(*_counts, **_cells):
        raise MemoryBudgetError("too much")

    with pytest.raises(MemoryBudgetError):
        extract_surface(uploaded, settings, reserve=refuse)
    again = extract_surface(uploaded, settings)
    assert again.mesh.positions.numpy().tobytes() == surface.mesh.positions.numpy().tobytes()


def test_slice_positions_are_left_aside_where_slices_are_to_be_even():
    positions = np.cumsum([0.0, *np.random.default_rng(2).uniform(0.5, 2.0, 8)])
    values = smooth_noise(9).values
    uneven = volume_of(values, slice_positions=positions)
    plain = extract_surface(upload_volume(volume_of(values), DEVICE), SurfaceSettings(isovalue=0.0))
    even = extract_surface(upload_volume(uneven, DEVICE), SurfaceSettings(isovalue=0.0), even_slices=True)
    mapped = extract_surface(upload_volume(uneven, DEVICE), SurfaceSettings(isovalue=0.0))
    assert even.mesh.positions.numpy().tobytes() == plain.mesh.positions.numpy().tobytes()
    assert even.placement.frame.depths.shape[0] == 0
    heights = np.interp(plain.mesh.positions.numpy()[:, 2], np.arange(9), positions)
    np.testing.assert_allclose(mapped.mesh.positions.numpy()[:, 2], heights, atol=1e-5)


@pytest.mark.parametrize("border", ["open", "closed"])
def test_numbers_before_each_block_of_words_end_in_the_number_of_all(extract, border):
    surface = extract(white_noise(40), border=border)
    starts = surface.numbering.quad_starts.numpy()
    assert starts[0] == 0
    assert (np.diff(starts) >= 0).all()
    assert (len(starts), starts[-1]) == (
        block_count(surface.placement.frame.grid) + 1,
        surface.mesh.face_count,
    )
    counts = surface.counts
    assert (
        counts.active_cells == surface.numbering.cells.ordinary_count + surface.numbering.cells.special_count
    )
    assert counts.no_data_nodes == 0
