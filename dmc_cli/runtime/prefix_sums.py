"""Sum counts exclusively, with the total as a last item; NumPy's sums take three times as long.

Short rows are scanned whole. Of a long one first the sum of each chunk is taken, then the sums before each
chunk, then those before each count, by all threads. Counts and their sums come as addresses, whatever the
dimensions of their arrays.
"""

import warp as wp

from dmc_cli.runtime.native_code import native

wp.set_module_options({"enable_backward": False})

CHUNK = 2048
"""Counts of a long row that one thread sums."""


@wp.func_native(native(__file__, "chunk_sum"))
def chunk_sum(counts: wp.uint64, begin: wp.int64, end: wp.int64) -> wp.int64:
    """Return the sum of the counts from `begin` up to `end`."""
    ...


@wp.func_native(native(__file__, "store_sums"))
def store_sums(
    counts: wp.uint64, length: wp.int64, begin: wp.int64, end: wp.int64, before: wp.int64, sums_out: wp.uint64
) -> None:
    """Store the sums before each of the counts from `begin` up to `end`, and the total if that is all."""
    ...


@wp.kernel
def scan_rows_kernel(
    # In:
    first: wp.int32,
    counts: wp.uint64,
    length: wp.int64,
    # Out:
    sums_out: wp.uint64,
) -> None:
    """Store the sum of a row's counts before each, and their total. One thread per row of `length` counts."""
    row = wp.uint64(first + wp.tid())
    size = wp.uint64(8)
    zero = wp.int64(0)
    sums = sums_out + size * row * wp.uint64(length + wp.int64(1))
    store_sums(counts + size * row * wp.uint64(length), length, zero, length, zero, sums)


@wp.kernel
def sum_chunks_kernel(
    # In:
    first: wp.int32,
    counts: wp.uint64,
    length: wp.int64,
    chunks: wp.int32,
    # Out:
    sums_out: wp.array(dtype=wp.int64),
) -> None:
    """Sum the chunks of rows of `length` counts. One thread per chunk, `chunks` a row."""
    n = first + wp.tid()
    row = wp.uint64(n / chunks)
    begin = wp.int64(n % chunks) * wp.int64(CHUNK)
    counts_of_row = counts + wp.uint64(8) * row * wp.uint64(length)
    sums_out[n] = chunk_sum(counts_of_row, begin, wp.min(begin + wp.int64(CHUNK), length))


@wp.kernel
def scan_chunks_kernel(
    # In:
    first: wp.int32,
    counts: wp.uint64,
    length: wp.int64,
    chunks: wp.int32,
    starts: wp.array(dtype=wp.int64),
    # Out:
    sums_out: wp.uint64,
) -> None:
    """Store the sum of a row's counts before each, and their total. One thread per chunk, `chunks` a row.

    `starts` are the sums of a row's counts before each of its chunks, and their total.
    """
    n = first + wp.tid()
    row = n / chunks
    chunk = n % chunks
    size = wp.uint64(8)
    begin = wp.int64(chunk) * wp.int64(CHUNK)
    end = wp.min(begin + wp.int64(CHUNK), length)
    counts_of_row = counts + size * wp.uint64(row) * wp.uint64(length)
    sums = sums_out + size * wp.uint64(row) * wp.uint64(length + wp.int64(1))
    store_sums(counts_of_row, length, begin, end, starts[row * (chunks + 1) + chunk], sums)
