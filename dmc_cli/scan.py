"""The exclusive prefix sum of a long array of counts, by all threads: NumPy's takes one.

First the sum of each chunk, then the sums before each chunk, then those before each count.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

CHUNK = 2048
"""Counts that one thread sums."""


@wp.func_native(
    f"""
    const long long* count = (const long long*)counts.data + {CHUNK} * (size_t)chunk;
    const int size = (int)counts.shape[0] - {CHUNK} * chunk;
    long long sum = 0;
    for (int n = 0; n < (size < {CHUNK} ? size : {CHUNK}); ++n) sum += count[n];
    return sum;
    """
)
def chunk_sum(counts: wp.array(dtype=wp.int64), chunk: wp.int32) -> wp.int64:
    """Return the sum of a chunk."""
    ...


@wp.func_native(
    f"""
    const long long* count = (const long long*)counts.data + {CHUNK} * (size_t)chunk;
    long long* sum = (long long*)sums_out.data + {CHUNK} * (size_t)chunk;
    const int size = (int)counts.shape[0] - {CHUNK} * chunk;
    for (int n = 0; n < (size < {CHUNK} ? size : {CHUNK}); ++n) {{
        sum[n] = before;
        before += count[n];
    }}
    """
)
def store_sums(
    counts: wp.array(dtype=wp.int64), chunk: wp.int32, before: wp.int64, sums_out: wp.array(dtype=wp.int64)
):
    """Store the sums before each count of a chunk."""
    ...


@wp.kernel
def sum_chunks_kernel(
    # In:
    first: wp.int32,
    counts: wp.array(dtype=wp.int64),
    # Out:
    sums_out: wp.array(dtype=wp.int64),
):
    """Sum the chunks. One thread a chunk."""
    chunk = first + wp.tid()
    sums_out[chunk] = chunk_sum(counts, chunk)


@wp.kernel
def scan_chunks_kernel(
    # In:
    first: wp.int32,
    counts: wp.array(dtype=wp.int64),
    chunk_starts: wp.array(dtype=wp.int64),
    # Out:
    sums_out: wp.array(dtype=wp.int64),
):
    """Store the sum of the counts before each. One thread a chunk."""
    chunk = first + wp.tid()
    store_sums(counts, chunk, chunk_starts[chunk], sums_out)
