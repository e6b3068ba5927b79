"""The small device functions that all else rests on, against NumPy: bits, words, marks, lanes, cells."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.bits.flags import flagged
from dmc_cli.bits.words import LANES, bit_index, has_bit, low_bits, next_node, previous_node
from dmc_cli.field.grid import Grid, GridShape
from dmc_cli.field.planes import step_along
from dmc_cli.field.simd_cells import BlockCells, FloatLanes, find_block_cells, load_points, store_points
from dmc_cli.field.slices import depth_of, node_distance, slice_distance
from dmc_cli.runtime.device import select_device

wp.set_module_options({"enable_backward": False, "max_unroll": 0})


@wp.kernel
def bits_kernel(
    first: wp.int32,
    words: wp.array(dtype=wp.uint32),
    counts: wp.array(dtype=wp.int32),
    out: wp.array2d(dtype=wp.uint32),
):
    n = first + wp.tid()
    word = words[n]
    out[n, 0] = low_bits(counts[n])
    out[n, 1] = wp.uint32(bit_index(word))
    out[n, 2] = next_node(word, words[n + 1])
    out[n, 3] = previous_node(words[n + 1], word)
    out[n, 4] = wp.where(has_bit(word, counts[n] & 31), wp.uint32(1), wp.uint32(0))


def numbers():
    """Return the same random numbers for each test, in whatever order they run."""
    return np.random.default_rng(8)


def test_words_of_bits(device):
    words = np.array([1, 2**31, 0xFFFFFFFF, 0x80000001, 6, *numbers().integers(1, 2**32, 60)], np.uint32)
    counts = np.resize([-1, 0, 1, 31, 32, 33, 7], len(words) - 1).astype(np.int32)
    out = wp.zeros((len(counts), 5), dtype=wp.uint32, device=device)
    inputs = [wp.array(words, device=device), wp.array(counts, device=device)]
    select_device(device, 1).launch(bits_kernel, len(counts), inputs, [out])
    low, index, following, before, has = out.numpy().T.astype(int)
    bits = np.unpackbits(words.view(np.uint8), bitorder="little").reshape(-1, 32).astype(bool)
    line = bits.ravel()
    packed = [line[32 * n : 32 * n + 34] for n in range(len(counts))]
    for n, count in enumerate(counts.tolist()):
        assert low[n] == 2 ** min(max(count, 0), 32) - 1
        assert index[n] == np.argmax(bits[n])
        assert following[n] == sum(1 << b for b in range(32) if packed[n][b + 1])
        assert before[n] == sum(1 << b for b in range(32) if line[32 * (n + 1) + b - 1])
        assert has[n] == bits[n][count & 31]


@wp.kernel
def step_kernel(
    first: wp.int32, grid: Grid, starts: wp.array(dtype=wp.vec3i), out: wp.array2d(dtype=wp.vec3i)
):
    n = first + wp.tid()
    for lane in range(LANES):
        out[n, lane] = step_along(grid, starts[n], lane)


@pytest.mark.parametrize(
    ("words", "ny"), [(1, 2), (1, 40), (2, 3), (3, 16), (15, 5), (16, 17), (17, 2), (40, 30)]
)
def test_sixteen_words_in_a_line_run_on_into_rows_and_layers(device, words, ny):
    shape = GridShape(32 * words, ny, 50, border=0)
    starts = np.array([(w, j, k) for w in range(words) for j in range(ny) for k in (0, 7)], np.int32)
    out = wp.zeros((len(starts), LANES), dtype=wp.vec3i, device=device)
    inputs = [shape.struct(), wp.array(starts, dtype=wp.vec3i, device=device)]
    select_device(device, 1).launch(step_kernel, len(starts), inputs, [out])
    at = (starts[:, 2] * ny + starts[:, 1]) * words + starts[:, 0]
    at = at[:, None] + np.arange(LANES)
    expected = np.stack([at % words, at // words % ny, at // (words * ny)], axis=-1)
    np.testing.assert_array_equal(out.numpy(), expected)


@wp.kernel
def marks_kernel(
    first: wp.int32,
    marks: wp.array(dtype=wp.uint8),
    span: wp.int32,
    wanted: wp.int32,
    out: wp.array(dtype=wp.uint32),
):
    n = first + wp.tid()
    out[n] = flagged(marks, n, span, wanted)


@pytest.mark.parametrize("wanted", [1, 4, 6, 255])
@pytest.mark.parametrize("span", [1, 5, 31, 32])
def test_marks_are_found_up_to_the_end_of_the_array(device, span, wanted):
    marks = numbers().choice([0, 0, 1, 2, 4, 128, 255], 100).astype(np.uint8)
    out = wp.zeros(100, dtype=wp.uint32, device=device)
    inputs = [wp.array(marks, device=device), span, wanted]
    select_device(device, 1).launch(marks_kernel, 100, inputs, [out])
    found = [sum(1 << b for b, mark in enumerate(marks[n : n + span]) if mark & wanted) for n in range(100)]
    np.testing.assert_array_equal(out.numpy(), found)


@wp.kernel
def cells_kernel(
    first: wp.int32,
    grid: Grid,
    cells: wp.array(dtype=wp.int64),
    size: wp.int32,
    out: wp.array(dtype=BlockCells),
):
    n = first + wp.tid()
    out[n] = find_block_cells(grid, cells, LANES * n, size)


@pytest.mark.parametrize("size", [1, 7, 16])
@pytest.mark.parametrize("border", [0, 1])
@pytest.mark.parametrize("shape", [(5, 4, 3), (65, 3, 70), (2000, 1500, 1500)])
def test_the_cells_of_a_block_are_those_of_their_numbers(shape, border, size):
    nx, ny, nz = (n + 2 * border for n in shape)
    count = (nx - 1) * (ny - 1) * (nz - 1)
    drawn = np.sort(numbers().integers(0, count, LANES))
    i, j, k = drawn % (nx - 1), drawn // (nx - 1) % (ny - 1), drawn // ((nx - 1) * (ny - 1))
    i[0], j[1], k[-1] = 0, ny - 2, nz - 2
    cells = (i + nx * (j + ny * k)).astype(np.int64)
    out = wp.zeros(1, dtype=BlockCells, device="cpu")
    inputs = [GridShape(nx, ny, nz, border).struct(), wp.array(cells, device="cpu"), size]
    select_device("cpu", 1).launch(cells_kernel, 1, inputs, [out])
    found = out.numpy()[0]
    lanes = np.minimum(np.arange(LANES), size - 1)
    for name, expected in (("i", i), ("j", j), ("k", k)):
        np.testing.assert_array_equal(found[name], expected[lanes])
    inner = [np.clip(x - border, 0, n - 2) for x, n in zip((i, j, k), shape, strict=True)]
    nodes = (inner[0] + shape[0] * (inner[1] + shape[1] * inner[2].astype(np.int64)))[lanes]
    far = np.abs(nodes - nodes[0]) > 2**30
    assert found["node"] == nodes[0]
    np.testing.assert_array_equal(found["far"], far)
    np.testing.assert_array_equal(found["offsets"], np.where(far, 0, nodes - nodes[0]))


@wp.kernel
def points_kernel(
    first: wp.int32, points: wp.array(dtype=wp.vec3), size: wp.int32, out: wp.array(dtype=wp.vec3)
):
    start = first + wp.tid() + 3
    lanes = load_points(points, start, size)
    x = FloatLanes()
    y = FloatLanes()
    z = FloatLanes()
    for lane in range(LANES):
        x[lane] = lanes[lane]
        y[lane] = lanes[LANES + lane]
        z[lane] = lanes[2 * LANES + lane]
    store_points(x, y, z, start, size, out)


@pytest.mark.parametrize("size", [1, 15, 16])
def test_points_come_out_of_lanes_as_they_went_in(size):
    points = numbers().standard_normal((20, 3)).astype(np.float32)
    out = wp.zeros(20, dtype=wp.vec3, device="cpu")
    select_device("cpu", 1).launch(
        points_kernel, 1, [wp.array(points, dtype=wp.vec3, device="cpu"), size], [out]
    )
    expected = np.zeros_like(points)
    expected[3 : 3 + size] = points[3 : 3 + size]
    np.testing.assert_array_equal(out.numpy(), expected)


@wp.kernel
def depths_kernel(
    first: wp.int32, depths: wp.array(dtype=wp.float64), last: wp.int32, out: wp.array2d(dtype=wp.float64)
):
    k = first + wp.tid()
    out[k, 0] = node_distance(depths, k)
    if k < last:
        out[k, 1] = depth_of(depths, k, wp.float64(0.25))
        out[k, 2] = slice_distance(depths, k)


@pytest.mark.parametrize("is_even", [True, False])
def test_depths_of_slices(device, is_even):
    depths = np.array([0.0, 0.5, 3.0, 3.5, 7.0])
    out = wp.zeros((5, 3), dtype=wp.float64, device=device)
    given = wp.array(np.zeros(0) if is_even else depths, dtype=wp.float64, device=device)
    select_device(device, 1).launch(depths_kernel, 5, [given, 4], [out])
    node, depth, step = out.numpy().T
    if is_even:
        depths = np.arange(5.0)
    np.testing.assert_allclose(node, mean_steps(depths))
    np.testing.assert_allclose(depth[:4], depths[:4] + 0.25 * np.diff(depths))
    np.testing.assert_allclose(step[:4], np.diff(depths))


def mean_steps(depths):
    """Return the mean distance from each slice to the slices beside it."""
    steps = np.diff(depths)
    return [steps[0], *(0.5 * (steps[1:] + steps[:-1])), steps[-1]]
