import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis.extra.numpy import arrays

from dmc_cli.writers.text import float_lines, quad_lines

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
    assert quad_lines(quads, b"4").decode() == expected


@pytest.mark.parametrize("top", [9, 10, 11, 99, 100, 101, 999_999, 1_000_000, 2_147_483_646])
def test_indices_from_one_with_their_normal(top):
    quads = np.array([[top - 3, top - 2, top - 1, top]], np.int32)
    words = " ".join(f"{index + 1}//{index + 1}" for index in quads[0].tolist())
    assert quad_lines(quads, b"f", first=1, repeat=2).decode() == f"f {words}\n"
