"""Opening and closing by balls are SciPy's, on any number of threads; nothing else moves."""

import json

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings as profile, strategies as st
from scipy import ndimage

from dmc_cli.errors import SettingsError
from dmc_cli.field import grid_of
from dmc_cli.parts.morphology import ball_of, closed, dilated, opened
from dmc_cli.runtime import select_device


def packed(mask, device):
    nz, ny, nx = mask.shape
    words = np.zeros((nz * ny, 4 * -(-nx // 32)), np.uint8)
    found = np.packbits(mask, axis=-1, bitorder="little").reshape(nz * ny, -1)
    words[:, : found.shape[1]] = found
    return wp.array(words.view(np.uint32), dtype=wp.uint32, device=device)


def unpacked(bits, shape):
    rows = np.unpackbits(bits.numpy().view(np.uint8), axis=1, count=shape[2], bitorder="little")
    return rows.reshape(shape).astype(bool)


def ball_nodes(radius, spacing):
    reach = [int(radius / step) + 1 for step in spacing]
    z, y, x = np.meshgrid(*[np.arange(-n, n + 1) for n in reversed(reach)], indexing="ij")
    x, y, z = (step * axis for step, axis in zip(spacing, (x, y, z), strict=True))
    return x**2 + y**2 + z**2 <= radius**2 * (1 + 1e-9)


@given(st.data())
@profile(max_examples=25)
def test_balls_are_those_of_scipy(data):
    spacing = data.draw(st.sampled_from([(1.0, 1.0, 1.0), (0.5, 1.0, 2.5), (2.0, 0.7, 0.7)]))
    radius = data.draw(st.sampled_from([1.0, 1.5, 2.5, 3.0, 20.0])) * min(spacing)
    shape = tuple(data.draw(st.integers(2, n)) for n in (9, 12, 70))
    mask = np.random.default_rng(data.draw(st.integers(0, 99))).random(shape)
    mask = ndimage.gaussian_filter(mask, 0.7) > data.draw(st.sampled_from([0.45, 0.5, 0.6]))
    device = select_device("cpu", data.draw(st.integers(1, 3)))
    grid, bits = grid_of(shape[::-1], 0), packed(mask, "cpu")
    ball, nodes = ball_of(radius, spacing, "gap"), ball_nodes(radius, spacing)
    assert np.array_equal(
        unpacked(dilated(bits, ball, grid, device), shape), ndimage.binary_dilation(mask, nodes)
    )
    eroded = ndimage.binary_erosion(mask, nodes, border_value=1)
    assert np.array_equal(
        unpacked(opened(bits, ball, grid, device), shape), ndimage.binary_dilation(eroded, nodes)
    )
    rest = ndimage.binary_dilation(ndimage.binary_erosion(~mask, nodes, border_value=1), nodes)
    assert np.array_equal(unpacked(closed(bits, ball, grid, device), shape), ~rest)


def test_a_ball_without_a_second_node_is_refused():
    with pytest.raises(SettingsError, match=r"close_gaps is 1\.8 mm, .* expected at least 2 mm"):
        ball_of(0.9, (1.0, 1.0, 3.0), "close_gaps")


def test_a_bridge_is_opened_and_a_slit_is_closed(run, tmp_path):
    values = np.zeros((24, 24, 60), np.uint8)
    values[6:18, 6:18, 5:25] = 200
    values[6:18, 6:18, 35:55] = 200
    values[11:13, 11:13, 25:35] = 200  # a bridge two nodes across
    values[6:18, 6:18, 14] = 10  # a slit
    np.save(tmp_path / "a.npy", values)
    words = [
        "convert",
        tmp_path / "a.npy",
        tmp_path / "a.ply",
        "-i",
        100,
        "--report",
        tmp_path / "a.json",
        "--force",
    ]

    def part(*more):
        result = run(*words, *more, "--check", "--require", "manifold,closed,on-surface")
        assert result.exit_code == 0, result.stderr
        report = json.loads((tmp_path / "a.json").read_text())
        return report["part"], report["topology"]["components"]

    told, pieces = part("--close-gaps", 3)
    assert told["closed"]["nodes"] == 140  # but four at its corners
    assert pieces == 1
    told, pieces = part("--open-gaps", 4)
    assert told["opened"]["nodes"] >= 4 * 8
    assert pieces == 3
    told, pieces = part("--open-gaps", 4, "--close-gaps", 3, "--keep", "largest")
    assert (told["dropped"]["components"], pieces) == (1, 1)


def test_nodes_without_data_are_never_filled(run, tmp_path):
    values = np.full((9, 9, 40), 5.0, np.float32)
    values[4, 4, 10:20] = np.nan
    values[4, 4, 25] = 0
    np.save(tmp_path / "a.npy", values)
    words = ["-i", 2, "--close-gaps", 4, "--allow-empty", "--report", tmp_path / "a.json"]
    assert run("convert", tmp_path / "a.npy", tmp_path / "a.ply", *words).exit_code == 0
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["part"]["closed"]["nodes"] == 1
    assert report["input"]["no_data_nodes"] == 10
