"""Reach an item beside an array in the way that is named, in a process of its own.

`python -m tests.checked.broken WAY ITEM`: all of it is well up to item 3.
"""

import sys

import warp as wp

from tests.checked.bounds import check_bounds

check_bounds()

from dmc_cli.runtime import native  # noqa: E402 the flags have to be there first


@wp.func_native(native(__file__, "read_item"))
def read_item(items: wp.array(dtype=wp.int32), at: wp.int32) -> wp.int32: ...


@wp.func_native(native(__file__, "read_run"))
def read_run(items: wp.array(dtype=wp.int32), at: wp.int32) -> wp.int32: ...


@wp.func_native(native(__file__, "write_row"))
def write_row(rows: wp.array2d(dtype=wp.int32), at: wp.int32) -> None: ...


@wp.func_native(native(__file__, "read_list"))
def read_list(at: wp.int32) -> wp.int32: ...


@wp.kernel
def item_kernel(items: wp.array(dtype=wp.int32), rows: wp.array2d(dtype=wp.int32), at: wp.int32):
    items[0] = read_item(items, at)


@wp.kernel
def run_kernel(items: wp.array(dtype=wp.int32), rows: wp.array2d(dtype=wp.int32), at: wp.int32):
    items[0] = read_run(items, at - 1)


@wp.kernel
def row_kernel(items: wp.array(dtype=wp.int32), rows: wp.array2d(dtype=wp.int32), at: wp.int32):
    write_row(rows, at)


@wp.kernel
def list_kernel(items: wp.array(dtype=wp.int32), rows: wp.array2d(dtype=wp.int32), at: wp.int32):
    items[0] = read_list(at)


@wp.kernel
def warp_kernel(items: wp.array(dtype=wp.int32), rows: wp.array2d(dtype=wp.int32), at: wp.int32):
    items[0] = items[at]


if __name__ == "__main__":
    items, rows = wp.zeros(4, dtype=wp.int32, device="cpu"), wp.zeros((2, 4), dtype=wp.int32, device="cpu")
    kernel = globals()[f"{sys.argv[1]}_kernel"]
    wp.launch(kernel, dim=1, inputs=[items, rows, int(sys.argv[2])], device="cpu")
    print("done")
