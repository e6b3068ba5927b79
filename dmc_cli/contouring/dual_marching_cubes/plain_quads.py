"""Connect quads as if all cells round them were ordinary, for all edges of a block of words.

A cell's vertex is the rank of its bit; the cell before an ordinary one along x has the vertex before. Axis
and normal are selected, not branched upon.
"""

import warp as wp

from dmc_cli.bits.bit_lists import LIST_BITS, ON_GPU
from dmc_cli.bits.words import Words

QuadEdges = wp.types.vector(length=48, dtype=wp.uint32)
"""The nodes of a block of words from which an edge along x, y, z goes up that carries a quad: a bit each."""


@wp.func_native(
    f"""
    struct Side {{ unsigned int cells; int first; }};  // a word of cells, the vertex of the first
    auto vertex = [](const Side& side, unsigned int below) {{
        return side.first + (int)wp::bit_count(side.cells & below);
    }};
    auto store = [&](const Side* sides, unsigned int forward, int axis, int b, int* quad) {{
        unsigned int below = (1u << b) - 1u;
        int here = vertex(sides[0], below), low = vertex(sides[1], below);
        int front = vertex(sides[2], below), both = vertex(sides[3], below);
        int second = axis == 2 ? low : front;
        int first = axis == 0 ? both : second - 1, last = axis == 0 ? low : here - 1;
        bool turned = (axis == 1) == (forward >> b & 1u);
        quad[0] = first;
        quad[1] = turned ? last : second;
        quad[2] = here;
        quad[3] = turned ? second : last;
    }};
    const unsigned int* cells = (const unsigned int*)ordinary.data + at;
    const int* ranks = (const int*)rank.data;
    const int offsets[4] = {{0, row, layer, layer + row}};
    auto look_up = [&](int lane, Side* sides) {{
        for (int side = 0; side < 4; ++side) {{
            int word = n + lane - offsets[side];
            sides[side] = Side{{cells[lane - offsets[side]], ranks[word > 0 ? word : 0]}};
        }}
    }};
    int* quad = (int*)quads_out.data + 4 * (size_t)q;
    #if {ON_GPU}
    for (int lane = 0; lane < 16; ++lane) {{
        if (!(edges[lane] | edges[16 + lane] | edges[32 + lane])) continue;
        Side sides[4];
        look_up(lane, sides);
        for (int axis = 0; axis < 3; ++axis) {{
            for (unsigned int left = edges[16 * axis + lane]; left; left &= left - 1, quad += 4) {{
                store(sides, forward[lane], axis, wp::bit_count(~left & (left - 1)), quad);
            }}
        }}
    }}
    #else
    {LIST_BITS}
    Side sides[16][4];
    unsigned short codes[3 * 16 * 32 + 32];
    unsigned short* end = codes;
    for (int lane = 0; lane < 16; ++lane) {{
        if (!(edges[lane] | edges[16 + lane] | edges[32 + lane])) continue;
        look_up(lane, sides[lane]);
        for (int axis = 0; axis < 3; ++axis) {{
            end = list_bits(edges[16 * axis + lane], lane << 7 | axis << 5, end);
        }}
    }}
    for (const unsigned short* code = codes; code < end; ++code, quad += 4) {{
        store(sides[*code >> 7], forward[*code >> 7], *code >> 5 & 3, *code & 31, quad);
    }}
    #endif
    """
)
def store_plain_quads(
    edges: QuadEdges,
    forward: Words,
    ordinary: wp.array(dtype=Words),
    rank: wp.array(dtype=wp.int32),
    at: wp.int32,
    n: wp.int32,
    row: wp.int32,
    layer: wp.int32,
    q: wp.int32,
    quads_out: wp.array(dtype=wp.vec4i),
) -> None:
    """Store the quads round the edges of a block, the first of which is q.

    The block's first word is `at` of the ordinary cells' line and n of their ranks; `row` and `layer` are the
    words of a row and a layer; `forward` tells which nodes' quads round x and z edges have their normal along
    the axis, and those round y edges against it.
    """
    ...
