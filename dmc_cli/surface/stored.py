"""Stored values of any type: the few functions that read the volume.

The values are an array of bytes and a tag that says which type they are. Each reader is one loop in C++ that
is compiled for every type, so that no other code depends on the type, and so that the compiler finds the
vector instructions that loops over Warp's arrays, whose strides it does not know, do not give: reading the
volume is twice to six times as fast.
"""

from typing import Any

import warp as wp

from dmc_cli.surface.trilinear import CornerValues64
from dmc_cli.surface.words import LANES

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
    _for_each_type(
        """
        wp::vec_t<16, double> lanes;
        for (int lane = 0; lane < 16; ++lane) lanes[lane] = (double)nodes[offsets[lane]];
        return lanes;
        """
    )
)
def values_at(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, offsets: IntLanes
) -> DoubleLanes:
    """Return the stored values `offsets` nodes after node `at`."""
    ...


@wp.func_native(
    _for_each_type(
        """
        wp::vec_t<64, double> lanes;
        #if defined(__clang__) && !defined(__CUDA_ARCH__)
        auto example = *nodes;
        typedef decltype(example) value_t;
        typedef value_t values_t __attribute__((ext_vector_type(16)));
        typedef double doubles_t __attribute__((ext_vector_type(16)));
        auto keep = [&](int n, values_t stored) {
            doubles_t numbers = __builtin_convertvector(stored, doubles_t);
            __builtin_memcpy((double*)&lanes + 16 * n, &numbers, sizeof(numbers));
        };
        auto unpack = [&](auto empty, auto part, int count) {  // `count` values a word
            typedef decltype(empty) word_t;
            typedef decltype(part) part_t;
            typedef word_t words_t __attribute__((ext_vector_type(16)));
            typedef part_t parts_t __attribute__((ext_vector_type(16)));
            for (int begin = 0; begin < 4; begin += count) {
                words_t words;
                for (int lane = 0; lane < 16; ++lane) {
                    word_t word;
                    __builtin_memcpy(&word, nodes + offsets[lane] + begin, sizeof(word));
                    words[lane] = word;
                }
                for (int n = 0; n < count; ++n) {
                    words_t shifted = words >> (word_t)(8 * sizeof(value_t) * n);
                    keep(begin + n, __builtin_bit_cast(values_t, __builtin_convertvector(shifted, parts_t)));
                }
            }
        };
        if constexpr (sizeof(value_t) == 1) unpack((unsigned int)0, (unsigned char)0, 4);
        else if constexpr (sizeof(value_t) == 2) unpack((unsigned long long)0, (unsigned short)0, 4);
        else if constexpr (sizeof(value_t) == 4) unpack((unsigned long long)0, (unsigned int)0, 2);
        else unpack((unsigned long long)0, (unsigned long long)0, 1);
        #else
        for (int n = 0; n < 4; ++n)
            for (int lane = 0; lane < 16; ++lane) lanes[16 * n + lane] = (double)nodes[offsets[lane] + n];
        #endif
        return lanes;
        """
    )
)
def rows_at(values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, offsets: IntLanes) -> RowLanes:
    """Return four values of a row from each of the nodes `offsets` after node `at` on.

    They are read together: all four of one or two bytes in a word, else two or one.
    """
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
):
    """Ask memory for the values of the cell at node `at`; a row and a layer have that many nodes."""
    ...
