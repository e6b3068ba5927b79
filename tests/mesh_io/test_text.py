import tracemalloc

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis.extra.numpy import arrays

from dmc_cli.mesh_io import text
from dmc_cli.mesh_io.text import chunks_of, face_lines, float_lines

finite_rows = arrays(
    np.float32,
    st.tuples(st.integers(1, 20), st.just(3)),
    elements=st.floats(width=32, allow_nan=False, allow_infinity=False),
)


@given(finite_rows)
@example(np.array([[0.1, -0.0, 1e-45], [3.4028235e38, 16777216, 1e-5], [1e16, 123456.79, 1 / 3]], np.float32))
def test_floats_read_back_as_the_same_float32(rows):
    lines = float_lines(rows, b"v ").decode().splitlines()
    assert all(line.startswith("v ") for line in lines)
    back = np.array([line.split()[1:] for line in lines], np.float32)
    np.testing.assert_array_equal(back.view(np.uint32), rows.view(np.uint32))


@given(finite_rows)
def test_no_shorter_decimal_reads_back(rows):
    words = float_lines(rows).decode().split()
    for word, value in zip(words, rows.ravel(), strict=True):
        digits = len(word.lstrip("-").split("e")[0].replace(".", "").strip("0"))
        shortest = np.format_float_scientific(value, unique=True, trim="-").lstrip("-").split("e")[0]
        assert digits <= max(1, len(shortest.replace(".", "")))


@given(arrays(np.int32, st.tuples(st.integers(1, 9), st.just(4)), elements=st.integers(0, 20_000)))
def test_indices_of_any_length_are_written_plainly(quads):
    expected = "".join("4 " + " ".join(map(str, quad)) + "\n" for quad in quads.tolist())
    assert face_lines(quads).decode() == expected


@pytest.mark.parametrize("repeat", [1, 2])
def test_indices_far_apart_take_no_more_memory_than_near_ones(repeat):
    near = np.arange(10_000_000, 10_400_000, dtype=np.int32).reshape(-1, 4)
    far = near.copy()
    far[::2500, 2] += 20_000_000  # the vertices of special cells come last
    peaks = []
    for quads in (near, far):
        tracemalloc.start()
        lines = [face_lines(rows, b"f", first=1, repeat=repeat) for rows in chunks_of(quads)]
        peaks.append(tracemalloc.get_traced_memory()[1] - sum(map(len, lines)))
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]
    words = b"".join(lines).split()[1::5]
    assert [int(word.split(b"/")[0]) for word in words[::2500]] == (far[::2500, 0] + 1).tolist()


@pytest.mark.parametrize("columns", [1, 3])
def test_chunks_are_all_rows_in_their_order(columns, monkeypatch):
    monkeypatch.setattr(text, "CHUNK_ROWS", 4)
    rows = np.arange(11 * columns, dtype=np.float32).reshape(11, columns)
    chunks = list(chunks_of(np.asfortranarray(rows)))
    assert [len(chunk) for chunk in chunks] == [4, 4, 3]
    assert all(chunk.flags.c_contiguous for chunk in chunks)
    np.testing.assert_array_equal(np.concatenate(chunks), rows)
    assert list(chunks_of(rows[:0])) == []
    assert [len(chunk) for chunk in chunks_of(rows[:4])] == [4]


def test_floats_of_one_column_are_a_number_a_line():
    rows = np.array([[1.5], [-2.0], [1e-7]], np.float32)
    assert float_lines(rows) == b"1.5\n-2.0\n1e-7\n"
    assert float_lines(rows[:1], b"v ") == b"v 1.5\n"


@pytest.mark.parametrize("top", [9, 10, 11, 99, 100, 101, 999_999, 1_000_000, 2_147_483_646])
def test_indices_from_one_with_their_normal(top):
    quads = np.array([[top - 3, top - 2, top - 1, top]], np.int32)
    words = " ".join(f"{index + 1}//{index + 1}" for index in quads[0].tolist())
    assert face_lines(quads, b"f", first=1, repeat=2).decode() == f"f {words}\n"
