"""Read stored values of any type: the few functions that touch the volume.

The values are an array of bytes and a tag that says which type they are. Each reader is one loop in C++ that
is compiled for every type, so that no other code depends on the type, and so that the compiler finds the
vector instructions that loops over Warp's arrays, whose strides it does not know, do not give: reading the
volume is twice to six times as fast.
"""

from typing import Any

import warp as wp

from dmc_cli.bits.words import LANES
from dmc_cli.field.trilinear import CornerValues64

STORED_TYPES: dict[str, Any] = {
    "uint8": wp.uint8,
    "int8": wp.int8,
    "uint16": wp.uint16,
    "int16": wp.int16,
    "uint32": wp.uint32,
    "int32": wp.int32,
    "float32": wp.float32,
    "float64": wp.float64,
}
"""The value types that kernels read; the order is the tag `kind`."""

KINDS = {name: kind for kind, name in enumerate(STORED_TYPES)}

_NATIVE_TYPES = ("uint8_t", "int8_t", "uint16_t", "int16_t", "uint32_t", "int32_t", "float", "double")

IntLanes = wp.types.vector(length=LANES, dtype=wp.int32)
DoubleLanes = wp.types.vector(length=LANES, dtype=wp.float64)

AxisOffsets = wp.types.vector(length=4, dtype=wp.int64)
"""How many nodes lie before each of four layers across an axis."""

CubeValues = wp.types.vector(length=64, dtype=wp.float64)
"""Values at the nodes round a cell, four along each axis, x fastest."""

PairLanes = wp.types.vector(length=2 * LANES, dtype=wp.float64)
"""Two values in a row for each lane: the first ones, then the second ones."""

RowLanes = wp.types.vector(length=4 * LANES, dtype=wp.float64)
"""Four values in a row for each lane: the first ones, then the second ones."""


def _for_each_type(body: str) -> str:
    """Return C++ that runs `body` with `nodes` pointing at node `at` of `values`, in the type that it has."""
    cases = "".join(
        f"case {kind}: return read((const {native}*)values.data + at);\n"
        for kind, native in enumerate(_NATIVE_TYPES[:-1])
    )
    last = f"default: return read((const {_NATIVE_TYPES[-1]}*)values.data + at);"
    return f"auto read = [&](auto nodes) {{{body}}};\nswitch (kind) {{\n{cases}{last}\n}}"


@wp.func_native(_for_each_type("return (double)*nodes;"))
def value_at(values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64) -> wp.float64:
    """Return the stored value of node `at` of the volume, x fastest."""
    ...


@wp.func_native(
    _for_each_type(
        """
        wp::vec_t<8, double> corners;
        for (int c = 0; c < 8; ++c)
            corners[c] = (double)nodes[(c & 1) + (c >> 1 & 1) * row + (c >> 2) * layer];
        return corners;
        """
    )
)
def cell_at(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, row: wp.int64, layer: wp.int64
) -> CornerValues64:
    """Return the stored values of the cell at node `at`; a row and a layer have that many nodes."""
    ...


@wp.func_native(
    "const long long at = 0;\n"
    + _for_each_type(
        """
        wp::vec_t<64, double> cube;
        for (int n = 0; n < 64; ++n) cube[n] = (double)nodes[x[n & 3] + y[n >> 2 & 3] + z[n >> 4]];
        return cube;
        """
    )
)
def cube_at(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, x: AxisOffsets, y: AxisOffsets, z: AxisOffsets
) -> CubeValues:
    """Return the stored values of the nodes, x fastest, in four layers across each axis."""
    ...


def _read_rows(length: int, most: int) -> str:
    """Return C++ that reads `length` values in a row from each of sixteen nodes.

    As many of them as `most` bytes hold are read as one word, which is taken apart in vectors.
    """
    return f"""
        wp::vec_t<{16 * length}, double> lanes;
        #if defined(__clang__) && !defined(__CUDA_ARCH__)
        auto example = *nodes;
        typedef decltype(example) value_t;
        typedef value_t values_t __attribute__((ext_vector_type(16)));
        typedef double doubles_t __attribute__((ext_vector_type(16)));
        auto unpack = [&](auto word, auto part) {{
            typedef decltype(word) words_t __attribute__((ext_vector_type(16)));
            typedef decltype(part) parts_t __attribute__((ext_vector_type(16)));
            const int count = sizeof(word) / sizeof(value_t);
            for (int begin = 0; begin < {length}; begin += count) {{
                words_t words;
                for (int lane = 0; lane < 16; ++lane) {{
                    __builtin_memcpy(&word, nodes + offsets[lane] + begin, sizeof(word));
                    words[lane] = word;
                }}
                for (int n = 0; n < count; ++n) {{
                    words_t shifted = words >> (decltype(word))(8 * sizeof(value_t) * n);
                    parts_t parts = __builtin_convertvector(shifted, parts_t);
                    doubles_t numbers =
                        __builtin_convertvector(__builtin_bit_cast(values_t, parts), doubles_t);
                    __builtin_memcpy((double*)&lanes + 16 * (begin + n), &numbers, sizeof(numbers));
                }}
            }}
        }};
        constexpr int row = sizeof(value_t) * {length};
        constexpr int size = row < {most} ? row : {most};
        if constexpr (size > sizeof(value_t)) {{
            if constexpr (sizeof(value_t) == 1 && size == 2) unpack((unsigned short)0, (unsigned char)0);
            else if constexpr (sizeof(value_t) == 1) unpack((unsigned int)0, (unsigned char)0);
            else if constexpr (sizeof(value_t) == 2 && size == 4) unpack((unsigned int)0, (unsigned short)0);
            else if constexpr (sizeof(value_t) == 2) unpack((unsigned long long)0, (unsigned short)0);
            else unpack((unsigned long long)0, (unsigned int)0);
            return lanes;
        }}
        #endif
        for (int n = 0; n < {length}; ++n)
            for (int lane = 0; lane < 16; ++lane) lanes[16 * n + lane] = (double)nodes[offsets[lane] + n];
        return lanes;
    """


@wp.func_native(_for_each_type(_read_rows(2, most=4)))
def pairs_at(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, offsets: IntLanes
) -> PairLanes:
    """Return two values of a row from each of the nodes `offsets` after node `at` on.

    To take two floats from a word costs more than to read both.
    """
    ...


@wp.func_native(_for_each_type(_read_rows(4, most=8)))
def rows_at(values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, offsets: IntLanes) -> RowLanes:
    """Return four values of a row from each of the nodes `offsets` after node `at` on."""
    ...


@wp.func_native(
    _for_each_type(
        """
        auto level = *nodes;
        level = (decltype(level))threshold;
        unsigned int bits = 0;
        for (int b = 0; b < count; ++b) bits |= (unsigned int)(nodes[b] >= level) << b;
        return bits;
        """
    )
)
def bits_at_least(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, count: wp.int32, threshold: wp.float64
) -> wp.uint32:
    """Return a bit for each of `count` nodes, 32 at most, from `at` on: whether it is at or above a number.

    The number is one of the values' type.
    """
    ...


@wp.func_native(
    _for_each_type(
        """
        unsigned int bits = 0;
        for (int b = 0; b < count; ++b) bits |= (unsigned int)(nodes[b] * 0 == 0) << b;
        return bits;
        """
    )
)
def finite_bits(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, count: wp.int32
) -> wp.uint32:
    """Return a bit for each of `count` nodes, 32 at most, from `at` on: whether it is finite."""
    ...


@wp.func_native(
    _for_each_type(
        """
        auto level = *nodes;
        level = (decltype(level))threshold;
        unsigned int* words = (unsigned int*)((char*)out.data + (size_t)row * (size_t)out.strides[0]);
        int done = 0;
        bool is_finite = true;
        #if defined(__clang__) && !defined(__CUDA_ARCH__)
        typedef decltype(level) values_t __attribute__((ext_vector_type(32), aligned(1)));
        typedef bool bits_t __attribute__((ext_vector_type(32)));
        values_t zeros = 0;
        for (; done + 32 <= count; done += 32) {
            for (int line = 0; line < (int)sizeof(values_t); line += 64)
                __builtin_prefetch((const char*)(nodes + done) + line + 4096);
            values_t word = *(const values_t*)(nodes + done);
            bits_t is_above = __builtin_convertvector(word >= level, bits_t);
            words[done / 32] = __builtin_bit_cast(unsigned int, is_above);
            zeros += word * (decltype(level))0;
        }
        for (int b = 0; b < 32; ++b) is_finite &= zeros[b] == 0;
        #endif
        for (; done < count; done += 32) {
            unsigned int bits = 0;
            for (int b = 0; b < 32 && done + b < count; ++b) {
                bits |= (unsigned int)(nodes[done + b] >= level) << b;
                is_finite &= nodes[done + b] * (decltype(level))0 == 0;
            }
            words[done / 32] = bits;
        }
        return is_finite;
        """
    )
)
def compare_row(
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    at: wp.int64,
    count: wp.int32,
    threshold: wp.float64,
    out: wp.array2d(dtype=wp.uint32),
    row: wp.int32,
) -> wp.bool:
    """Write a bit for each of `count` nodes from `at` on to a row of words: is it at or above a number?

    Return whether all values are finite: times 0 all others are 0. This is the loop that reads every node.
    With clang's vectors a word takes a comparison or two, and memory sets the speed: asking for it a page
    ahead, which processors do not do by themselves, gives a third to a half more.
    """
    ...


@wp.func_native(
    _for_each_type(
        """
        #if defined(__clang__) && !defined(__CUDA_ARCH__)
        __builtin_prefetch(nodes);
        __builtin_prefetch(nodes + row);
        __builtin_prefetch(nodes + layer);
        __builtin_prefetch(nodes + row + layer);
        #endif
        """
    )
)
def fetch_cell(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, row: wp.int64, layer: wp.int64
) -> None:
    """Ask memory for the values of the cell at node `at`; a row and a layer have that many nodes."""
    ...
